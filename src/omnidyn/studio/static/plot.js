import { LEFT, RIGHT, css, make, save, sharp, short, socketUrl, ticks } from './draw.js';

// One socket for all pictures of a page; answers come in the order of the requests
const wire = {
  askers: [],
  ask(plot, request) {
    const text = JSON.stringify(request);
    if (!this.socket) {
      this.socket = new WebSocket(socketUrl('/plot'));
      this.socket.binaryType = 'arraybuffer';
      this.socket.onmessage = (e) => this.askers.shift()?.take(e.data);
      this.socket.onclose = () => {
        const left = this.askers.splice(0);
        this.socket = null;
        setTimeout(() => left.forEach((p) => { p.waiting = false; p.ask(); }), 1000);
      };
    }
    this.askers.push(plot);
    if (this.socket.readyState === 1) this.socket.send(text);
    else this.socket.addEventListener('open', () => this.socket.send(text));
  },
};

const views = new Map(); // series -> what is looked at of it: the page is laid out anew where something changes
const HINT = 'Drag to pan, wheel or + and - to zoom';
const LEAST = { m: 1e-4, rad: 1e-4 }; // of what an axis shows, by its unit
const TOP = 20, PANEL = 110, GAP = 24, BOTTOM = 38;
const tall = (panels) => TOP + panels * (PANEL + GAP) - GAP + BOTTOM;

// A frame of the server: its head, and its numbers
function frame(data) {
  if (data.byteLength < 8) return null;
  const length = new DataView(data).getUint32(0, true);
  return { ...JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))), numbers: new Float32Array(data, 4 + length) };
}

// What a picture shows of one series: it asks for the stretch that is looked at, once at a time
class Layer {
  constructor(plot, series, meta) { Object.assign(this, { plot, series, meta, offset: 0, shown: null, waiting: false }); }
  ask() {
    const plot = this.plot;
    if (!plot.isConnected) return;
    if (this.waiting) { this.again = true; return; }
    this.waiting = true; this.again = false;
    wire.ask(this, { series: this.series, begin: plot.view[0] - this.offset, end: plot.view[1] - this.offset,
      width: Math.round(plot.inner() * (window.devicePixelRatio || 1)) });
  }
  take(data) {
    this.waiting = false;
    if (this.again) this.ask();
    this.shown = frame(data) || this.shown;
    this.plot.frames++;
    this.plot.draw();
  }
  index(name) { return this.meta.panels.flatMap((p) => p.signals).indexOf(name); }
}

// Signals over time, one panel below the other, with findings shaded; another log may be drawn over them
class Plot extends HTMLElement {
  static observedAttributes = ['data-series', 'data-spans', 'data-other', 'data-offset'];
  connectedCallback() {
    if (!this.canvas) this.build();
    this.resize = new ResizeObserver(() => this.ask());
    this.resize.observe(this);
    this.load();
  }
  disconnectedCallback() { this.resize?.disconnect(); }
  attributeChangedCallback(name) {
    if (!this.isConnected || !this.canvas) return;
    if (name === 'data-offset') this.move(+this.dataset.offset);
    else if (name === 'data-spans') this.draw(); else this.load();
  }
  build() {
    const tools = make('div', this, { className: 'tools' });
    make('button', tools, { type: 'button', textContent: 'All', onclick: () => this.look(...this.ends()) });
    make('button', tools, { type: 'button', textContent: 'Save picture', onclick: () => save(this.canvas, this.dataset.name) });
    this.readout = make('span', tools, { textContent: HINT });
    this.story = make('div', this, { className: 'story', hidden: true });
    this.story.setAttribute('role', 'status');
    this.canvas = make('canvas', this, { tabIndex: 0 });
    this.canvas.style.height = `${tall(+this.dataset.panels)}px`; // its place, before there is anything to draw
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', 'Signals over time');
    this.frames = 0;
    const c = this.canvas;
    c.addEventListener('wheel', (e) => { if (!this.meta) return; e.preventDefault(); this.zoom(Math.exp(e.deltaY * 0.002), this.time(e.offsetX)); }, { passive: false });
    c.onpointerdown = (e) => {
      this.drag = { x: e.offsetX, view: [...this.view], moved: false, second: e.shiftKey && this.second, offset: this.second?.offset };
      c.setPointerCapture(e.pointerId);
    };
    c.onpointermove = (e) => {
      if (!this.meta) return;
      if (!this.drag) { this.readout.textContent = `t = ${short(this.time(e.offsetX))} s`; return; }
      const shift = (this.drag.x - e.offsetX) * (this.drag.view[1] - this.drag.view[0]) / this.inner();
      this.drag.moved ||= Math.abs(e.offsetX - this.drag.x) > 3;
      if (this.drag.moved && this.drag.second) {
        this.move(this.drag.offset - shift);
        this.readout.textContent = `${short(this.second.offset)} s added`;
      } else if (this.drag.moved) this.look(this.drag.view[0] + shift, this.drag.view[1] + shift);
    };
    c.onpointerup = (e) => {
      const drag = this.drag;
      this.drag = null;
      if (drag && !drag.moved) this.pick(e.offsetX);
      else if (drag?.second) this.dispatchEvent(new CustomEvent('moved', { detail: this.second.offset }));
    };
    c.onkeydown = (e) => {
      const span = this.view[1] - this.view[0], middle = (this.view[0] + this.view[1]) / 2;
      const acts = { '+': () => this.zoom(0.7, middle), '-': () => this.zoom(1.4, middle),
        ArrowLeft: () => this.look(this.view[0] - span / 8, this.view[1] - span / 8),
        ArrowRight: () => this.look(this.view[0] + span / 8, this.view[1] + span / 8) };
      if (acts[e.key]) { e.preventDefault(); acts[e.key](); }
    };
    this.dark = new MutationObserver(() => this.draw());
    this.dark.observe(document.body, { attributes: true, attributeFilter: ['class'] });
  }
  async load() {
    const { series, other } = this.dataset;
    const answers = await Promise.all([series, other].map((key) => key && fetch(`/series/${key}`)));
    const [meta, second] = await Promise.all(answers.map((answer) => (answer?.status === 200 ? answer.json() : null)));
    if (!meta || series !== this.dataset.series || other !== this.dataset.other) return;
    this.meta = meta;
    this.first = new Layer(this, series, meta);
    this.second = second && new Layer(this, other, second);
    if (this.second) this.second.offset = +this.dataset.offset;
    this.view = views.get(series) || this.ends();
    this.readout.textContent = this.second ? `${HINT}; with Shift a drag moves ${this.dataset.words}` : HINT;
    this.ask();
  }
  // From where to where there is anything, of both logs
  ends() {
    const of = [this.first, this.second].filter(Boolean);
    return [Math.min(...of.map((l) => l.meta.begin + l.offset)), Math.max(...of.map((l) => l.meta.end + l.offset))];
  }
  move(offset) {
    if (!this.second || this.second.offset === offset) return;
    this.second.offset = offset;
    this.second.ask();
    this.draw();
  }
  inner() { return Math.max(50, this.clientWidth - LEFT - RIGHT); }
  time(x) { return this.view[0] + (x - LEFT) / this.inner() * (this.view[1] - this.view[0]); }
  look(begin, end) {
    const [least, largest] = this.ends(), whole = largest - least;
    const span = Math.min(Math.max(end - begin, whole * 1e-6, 1e-6), whole || 1);
    const middle = (begin + end) / 2;
    const low = Math.min(Math.max(middle - span / 2, least), largest - span);
    this.view = [low, low + span];
    views.set(this.dataset.series, this.view);
    this.draw(); this.ask();
  }
  show(begin, end) {
    const edge = Math.max((end - begin) * 0.2, (this.meta.end - this.meta.begin) * 0.01);
    this.look(begin - edge, end + edge);
    this.scrollIntoView({ block: 'start' });
  }
  zoom(factor, at) { this.look(at + (this.view[0] - at) * factor, at + (this.view[1] - at) * factor); }
  ask() {
    this.first?.ask();
    this.second?.ask();
  }
  // Findings: all, or those about a signal of a panel; one about no signal is about every panel
  areas(panel) {
    const all = JSON.parse(this.dataset.spans || '[]'), known = this.meta.panels.flatMap((p) => p.signals);
    if (!panel) return all;
    return all.filter(([, , , , subject]) => {
      const about = subject.split(' ').filter((name) => known.includes(name));
      return !about.length || about.some((name) => panel.signals.includes(name));
    });
  }
  draw() { this.due ||= requestAnimationFrame(() => { this.due = 0; this.render(); }); }
  render() {
    if (!this.meta || !this.canvas) return;
    const panels = this.meta.panels, width = this.clientWidth;
    const height = tall(panels.length);
    const g = sharp(this.canvas, width, height), x = (t) => LEFT + (t - this.view[0]) / (this.view[1] - this.view[0]) * this.inner();
    let first = 0;
    panels.forEach((panel, k) => {
      const top = TOP + k * (PANEL + GAP);
      this.panel(g, panel, first, top, x, width);
      first += panel.signals.length;
    });
    const bottom = TOP + panels.length * (PANEL + GAP) - GAP;
    g.fillStyle = css('--quiet'); g.textAlign = 'center'; g.textBaseline = 'top';
    for (const t of ticks(this.view[0], this.view[1], this.inner() / 90)) g.fillText(short(t), x(t), bottom + 5);
    g.fillText('time [s]', LEFT + this.inner() / 2, bottom + 20);
    g.textAlign = 'right';
    g.fillText(this.second ? `pale: ${this.dataset.words}` : this.meta.title || '', width - RIGHT, bottom + 20);
  }
  panel(g, panel, first, top, x, width) {
    const inner = this.inner(), lines = [];
    panel.signals.forEach((name, k) => {
      for (const layer of [this.second, this.first]) { // the first is drawn over the other
        const index = layer === this.first ? first + k : layer?.index(name) ?? -1;
        if (index < 0 || !layer.shown) continue;
        const { points: n, numbers } = layer.shown;
        lines.push({ name, colour: css(`--c${k % 6}`), over: k > 1 && panel.signals[0] === 'measured', layer, n, numbers, at: n + 2 * n * index, x: (i) => x(layer.shown.begin + layer.offset + numbers[i]) });
      }
    });
    let low = Infinity, high = -Infinity;
    for (const { n, numbers, at } of lines)
      for (let i = at; i < at + 2 * n; i++) { const v = numbers[i]; if (v < low) low = v; if (v > high) high = v; }
    if (!(low <= high)) { low = -1; high = 1; }
    const least = LEAST[panel.unit] || 1e-3, more = (least - (high - low)) / 2; // what rests is no noise of 1e-6
    if (more > 0) { low -= more; high += more; }
    const edge = Math.max((high - low) * 0.06, Math.abs(high) * 1e-3, 1e-9);
    low -= edge; high += edge;
    const y = (v) => top + PANEL - (v - low) / (high - low) * PANEL;
    g.save();
    g.beginPath(); g.rect(LEFT, top, inner, PANEL); g.clip();
    for (const [, severity, begin, end] of this.areas(panel)) {
      g.fillStyle = css(`--${severity}-area`);
      const a = x(begin), b = Math.max(x(end), a + 2);
      g.fillRect(a, top, b - a, PANEL);
      if (severity !== 'note') { g.fillStyle = css(`--${severity}`); g.fillRect(a, top, b - a, 3); }
    }
    g.strokeStyle = css('--line'); g.lineWidth = 1;
    for (const v of ticks(low, high, 5)) { g.beginPath(); g.moveTo(LEFT, y(v)); g.lineTo(LEFT + inner, y(v)); g.stroke(); }
    for (const line of lines) this.line(g, line, y, inner);
    g.restore();
    g.strokeStyle = css('--quiet'); g.strokeRect(LEFT + 0.5, top + 0.5, inner, PANEL);
    g.fillStyle = css('--quiet'); g.textAlign = 'right'; g.textBaseline = 'middle';
    for (const v of ticks(low, high, 5)) g.fillText(short(v), LEFT - 5, y(v));
    g.textAlign = 'left'; g.textBaseline = 'bottom'; g.fillStyle = css('--ink');
    const title = `${panel.title} [${panel.unit || '1'}]`;
    g.fillText(title, LEFT, top - 3);
    let at = LEFT + g.measureText(title).width + 14;
    panel.signals.forEach((name, k) => {
      g.fillStyle = css(`--c${k % 6}`); g.fillRect(at, top - 11, 14, 3); g.fillStyle = css('--ink');
      g.fillText(name, at + 18, top - 3); at += 30 + g.measureText(name).width;
    });
  }
  line(g, { name, colour, over, layer, n, numbers, at, x }, y, inner) {
    const wide = name === 'measured' || layer === this.second; // the model, or the first log, is drawn over it
    g.strokeStyle = g.fillStyle = colour;
    g.lineWidth = wide ? 4 : 1.3; g.lineJoin = 'round'; g.globalAlpha = wide ? 0.45 : 1;
    g.beginPath();
    if (n > inner / 2 && layer.shown.rows > 20 * n) { // columns of pixels: strokes as dense as this take ten times as long
      let before = [NaN, NaN];
      for (let i = 0; i < n; i++) {
        let least = numbers[at + i], largest = numbers[at + n + i];
        if (Number.isNaN(least)) continue;
        const ends = [least, largest];
        if (before[1] < least) least = before[1];
        if (before[0] > largest) largest = before[0];
        before = ends;
        const px = Math.floor(x(i)), thick = wide ? 2 : 0.5;
        const bottom = Math.ceil(y(least) + thick), head = Math.floor(y(largest) - thick);
        g.rect(px, head, Math.max(1, Math.ceil(inner / n)), bottom - head);
      }
      g.fill();
    } else {
      let pen = false;
      for (let i = 0; i < n; i++) {
        const least = numbers[at + i], largest = numbers[at + n + i];
        if (Number.isNaN(least)) { if (!layer.meta.sparse) pen = pen && n > inner / 2; continue; }
        const px = x(i);
        if (pen) g.lineTo(px, y(least)); else g.moveTo(px, y(least));
        if (largest !== least) g.lineTo(px, y(largest));
        pen = true;
      }
      if (over) g.setLineDash([7, 5]); // a second model, where both agree
      g.stroke();
      g.setLineDash([]);
    }
    g.globalAlpha = 1;
  }
  pick(px) {
    const t = this.time(px), reach = 4 * (this.view[1] - this.view[0]) / this.inner();
    const hits = this.areas().filter(([, , begin, end]) => t >= begin - reach && t <= end + reach);
    this.story.replaceChildren();
    this.story.hidden = !hits.length;
    for (const [k, severity] of hits) {
      const row = document.getElementById(`finding-${k}`), part = make('div', this.story, { className: `finding ${severity}` });
      for (const words of row?.querySelectorAll('.code, .text') || []) make('div', part, { className: words.className, textContent: words.textContent });
    }
  }
}

customElements.define('omni-plot', Plot);

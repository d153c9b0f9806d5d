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
const TOP = 20, PANEL = 110, GAP = 24, BOTTOM = 38;

// Signals over time, one panel below the other, with findings shaded
class Plot extends HTMLElement {
  static observedAttributes = ['data-series', 'data-spans'];
  connectedCallback() {
    if (!this.canvas) this.build();
    this.resize = new ResizeObserver(() => this.ask());
    this.resize.observe(this);
    this.waiting = false;
    this.load();
  }
  disconnectedCallback() { this.resize?.disconnect(); }
  attributeChangedCallback(name) {
    if (!this.isConnected || !this.canvas) return;
    if (name === 'data-series') this.load(); else this.draw();
  }
  build() {
    const tools = make('div', this, { className: 'tools' });
    make('button', tools, { type: 'button', textContent: 'All', onclick: () => this.look(this.meta.begin, this.meta.end) });
    make('button', tools, { type: 'button', textContent: 'Save picture', onclick: () => save(this.canvas, 'log.png') });
    this.readout = make('span', tools, { textContent: 'Drag to pan, wheel or + and - to zoom' });
    this.story = make('div', this, { className: 'story', hidden: true });
    this.story.setAttribute('role', 'status');
    this.canvas = make('canvas', this, { tabIndex: 0 });
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', 'Signals over time');
    this.frames = 0;
    const c = this.canvas;
    c.addEventListener('wheel', (e) => { if (!this.meta) return; e.preventDefault(); this.zoom(Math.exp(e.deltaY * 0.002), this.time(e.offsetX)); }, { passive: false });
    c.onpointerdown = (e) => { this.drag = { x: e.offsetX, view: [...this.view], moved: false }; c.setPointerCapture(e.pointerId); };
    c.onpointermove = (e) => {
      if (!this.meta) return;
      if (!this.drag) { this.readout.textContent = `t = ${short(this.time(e.offsetX))} s`; return; }
      const shift = (this.drag.x - e.offsetX) * (this.drag.view[1] - this.drag.view[0]) / this.inner();
      this.drag.moved ||= Math.abs(e.offsetX - this.drag.x) > 3;
      if (this.drag.moved) this.look(this.drag.view[0] + shift, this.drag.view[1] + shift);
    };
    c.onpointerup = (e) => { const still = this.drag && !this.drag.moved; this.drag = null; if (still) this.pick(e.offsetX); };
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
    const series = this.dataset.series;
    const answer = await fetch(`/series/${series}`);
    if (answer.status !== 200) return;
    this.meta = await answer.json();
    const [begin, end] = views.get(series) || [this.meta.begin, this.meta.end];
    this.view = [begin, end];
    this.shown = null;
    this.ask();
  }
  inner() { return Math.max(50, this.clientWidth - LEFT - RIGHT); }
  time(x) { return this.view[0] + (x - LEFT) / this.inner() * (this.view[1] - this.view[0]); }
  look(begin, end) {
    const whole = this.meta.end - this.meta.begin;
    const span = Math.min(Math.max(end - begin, whole * 1e-6, 1e-6), whole || 1);
    const middle = (begin + end) / 2;
    const low = Math.min(Math.max(middle - span / 2, this.meta.begin), this.meta.end - span);
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
    if (!this.meta || !this.isConnected) return;
    if (this.waiting) { this.again = true; return; }
    this.waiting = true; this.again = false;
    wire.ask(this, { series: this.dataset.series, begin: this.view[0], end: this.view[1],
      width: Math.round(this.inner() * (window.devicePixelRatio || 1)) });
  }
  take(data) {
    this.waiting = false;
    if (this.again) this.ask();
    if (data.byteLength < 8) return;
    const length = new DataView(data).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    const numbers = new Float32Array(data, 4 + length);
    this.shown = { ...head, numbers };
    this.frames++;
    this.draw();
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
    const height = TOP + panels.length * (PANEL + GAP) - GAP + BOTTOM;
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
  }
  panel(g, panel, first, top, x, width) {
    const shown = this.shown, n = shown ? shown.points : 0, inner = this.inner();
    let low = Infinity, high = -Infinity;
    for (let s = first; n && s < first + panel.signals.length; s++)
      for (let i = 0; i < 2 * n; i++) { const v = shown.numbers[n + 2 * n * s + i]; if (v < low) low = v; if (v > high) high = v; }
    if (!(low <= high)) { low = -1; high = 1; }
    if (high - low < 1e-9) { low -= 0.5; high += 0.5; }
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
    panel.signals.forEach((name, k) => {
      const at = n + 2 * n * (first + k);
      const wide = name === 'measured'; // the model is drawn over it
      g.strokeStyle = css(`--c${k % 6}`); g.lineWidth = wide ? 4 : 1.3; g.lineJoin = 'round'; g.globalAlpha = wide ? 0.45 : 1;
      g.beginPath();
      if (n > inner / 2 && shown.rows > 20 * n) { // columns of pixels: strokes as dense as this take ten times as long
        let before = [NaN, NaN];
        for (let i = 0; i < n; i++) {
          let least = shown.numbers[at + i], largest = shown.numbers[at + n + i];
          if (Number.isNaN(least)) continue;
          const ends = [least, largest];
          if (before[1] < least) least = before[1];
          if (before[0] > largest) largest = before[0];
          before = ends;
          const px = Math.floor(x(shown.begin + shown.numbers[i])), thick = wide ? 2 : 0.5;
          const bottom = Math.ceil(y(least) + thick), head = Math.floor(y(largest) - thick);
          g.rect(px, head, Math.max(1, Math.ceil(inner / n)), bottom - head);
        }
        g.fillStyle = css(`--c${k % 6}`); g.fill(); g.globalAlpha = 1;
        return;
      }
      let pen = false;
      for (let i = 0; i < n; i++) {
        const least = shown.numbers[at + i], largest = shown.numbers[at + n + i];
        if (Number.isNaN(least)) { if (!this.meta.sparse) pen = pen && n > inner / 2; continue; }
        const px = x(shown.begin + shown.numbers[i]);
        if (pen) g.lineTo(px, y(least)); else g.moveTo(px, y(least));
        if (largest !== least) g.lineTo(px, y(largest));
        pen = true;
      }
      g.stroke();
    });
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

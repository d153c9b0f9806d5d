// Studio: three elements that draw on a canvas. Numbers come from the server; nothing here computes one of them.

const css = (name) => getComputedStyle(document.body).getPropertyValue(name).trim();
const socketUrl = (path) => `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}${path}`;
const make = (tag, parent, more = {}) => parent.appendChild(Object.assign(document.createElement(tag), more));
const short = (x) => (x === 0 ? '0' : Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3 ? x.toExponential(1) : String(+x.toPrecision(4)));

// Round numbers between two ends, about so many
function ticks(low, high, count) {
  const raw = (high - low) / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= raw) || power;
  const marks = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) marks.push(k * step);
  return marks;
}

// A canvas as sharp as the screen; gives back its context in CSS pixels
function sharp(canvas, width, height) {
  const ratio = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    canvas.style.height = `${height}px`;
  }
  const g = canvas.getContext('2d');
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, width, height);
  g.font = '12px system-ui, sans-serif';
  return g;
}

function save(canvas, name) {
  const copy = document.createElement('canvas');
  copy.width = canvas.width; copy.height = canvas.height;
  const g = copy.getContext('2d');
  g.fillStyle = css('--paper'); g.fillRect(0, 0, copy.width, copy.height); g.drawImage(canvas, 0, 0);
  const link = document.createElement('a');
  link.href = copy.toDataURL('image/png'); link.download = name; link.click();
}

// A place to drop files on, or to click
class Drop extends HTMLElement {
  connectedCallback() {
    if (this.input) return;
    this.tabIndex = 0;
    this.setAttribute('role', 'button');
    this.say(this.getAttribute('words') || 'Drop a log here, or click');
    this.input = document.createElement('input');
    this.input.type = 'file'; this.input.multiple = true; this.input.hidden = true;
    this.after(this.input);
    this.input.onchange = () => { this.take(this.input.files); };
    this.onclick = () => this.input.click();
    this.onkeydown = (e) => { if (e.key === 'Enter' || e.key === ' ') { e.preventDefault(); this.input.click(); } };
    this.ondragover = (e) => { e.preventDefault(); this.classList.add('over'); };
    this.ondragleave = () => this.classList.remove('over');
    this.ondrop = (e) => { e.preventDefault(); this.classList.remove('over'); this.take(e.dataTransfer.files); };
  }
  disconnectedCallback() { if (this.input) this.input.remove(); this.input = null; }
  say(words) { this.textContent = words; }
  async take(files) {
    for (const file of files) {
      this.say(`Reading ${file.name} ...`);
      const answer = await fetch(`/upload?name=${encodeURIComponent(file.name)}`, { method: 'POST', body: file }).catch(() => null);
      this.say(answer && answer.ok ? this.getAttribute('words') || 'Drop a log here, or click'
        : `${file.name} was not taken: too large, or too many files`);
    }
  }
}

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

const LEFT = 62, RIGHT = 10, TOP = 20, PANEL = 110, GAP = 24, BOTTOM = 38;

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
    const before = this.meta;
    this.meta = await answer.json();
    if (!before || before.begin !== this.meta.begin || before.end !== this.meta.end) this.view = [this.meta.begin, this.meta.end];
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

const KEYS = { w: [0, 1], s: [0, -1], a: [1, 1], d: [1, -1], q: [2, 1], e: [2, -1],
  ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [1, 1], ArrowRight: [1, -1] };
const HEAD = 8, PER_WHEEL = 5, STRIP = 600; // numbers of a frame; frames of a strip

// The robot from above, driven by keys, sliders and a gamepad
class Drive extends HTMLElement {
  connectedCallback() {
    if (!this.canvas) this.build();
    this.socket = new WebSocket(socketUrl('/drive'));
    this.socket.binaryType = 'arraybuffer';
    this.received = 0; this.painted = 0;
    this.socket.onmessage = (e) => { this.newest = new Float32Array(e.data, 4); this.received++; this.keep(this.newest); };
    this.down = (e) => this.key(e, true); this.up = (e) => this.key(e, false);
    this.away = () => { this.held.clear(); this.send(); };
    addEventListener('keydown', this.down); addEventListener('keyup', this.up); addEventListener('blur', this.away);
    this.alive = true;
    requestAnimationFrame(() => this.paint());
  }
  disconnectedCallback() {
    this.alive = false; this.socket?.close();
    removeEventListener('keydown', this.down); removeEventListener('keyup', this.up); removeEventListener('blur', this.away);
  }
  static observedAttributes = ['data-robot'];
  attributeChangedCallback() {
    this.robot = JSON.parse(this.dataset.robot);
    if (this.sliders) for (const number of this.robot.numbers) this.sliders[number.key]?.(number.value);
    this.tell?.();
  }
  build() {
    this.held = new Set(); this.trail = []; this.strip = []; this.offset = this.robot.azimuth.map(() => 0);
    const stage = make('div', this, { className: 'stage' }), left = make('div', stage), right = make('div', stage);
    this.canvas = make('canvas', left, { tabIndex: 0 });
    this.canvas.setAttribute('role', 'img'); this.canvas.setAttribute('aria-label', 'The robot from above');
    this.state = make('div', left, { className: 'state' });
    make('div', left, { className: 'tools', innerHTML: '<span><b>W S</b> forward, back</span><span><b>A D</b> left, right</span><span><b>Q E</b> turn</span>' });
    const unit = this.robot.unit;
    make('h3', right, { textContent: 'Keys' });
    this.level = this.slider(right, `level of a key`, unit, 0, this.robot.limit, Math.min(this.robot.limit, this.robot.limit / 2), () => this.send(), 'level');
    this.note = make('div', right, { className: 'state', id: 'breakaway' });
    this.tell = () => {
      const volts = this.robot.breakaway;
      this.note.textContent = volts.every((v) => v === null) ? ''
        : `moves from ${['forward', 'sideways', 'turning'].map((n, k) => `${n} ${volts[k] === null ? '-' : short(volts[k])} ${unit}`).join(', ')}`;
    };
    this.tell();
    make('h3', right, { textContent: 'Each wheel' });
    this.robot.azimuth.forEach((_, k) => this.slider(right, `wheel ${k + 1}`, unit, -this.robot.limit, this.robot.limit, 0,
      (v) => { this.offset[k] = v; this.socket.send(JSON.stringify({ offset: this.offset })); }, `wheel-${k + 1}`));
    make('h3', right, { textContent: 'Change while it moves' });
    this.sliders = {};
    for (const n of this.robot.numbers)
      this.sliders[n.key] = this.slider(right, n.words, n.unit, 0, n.value > 0 ? 4 * n.value : 1, n.value,
        (v) => this.socket.send(JSON.stringify({ set: { [n.key]: v } })), n.key).set;
    this.strips = make('canvas', this);
    this.strips.setAttribute('role', 'img'); this.strips.setAttribute('aria-label', 'The last ten seconds');
    const tools = make('div', this, { className: 'tools' });
    make('button', tools, { type: 'button', textContent: 'Save picture', onclick: () => save(this.strips, 'drive.png') });
  }
  slider(parent, words, unit, low, high, value, act, name) {
    const label = make('label', parent);
    make('span', label, { textContent: words });
    const input = make('input', label, { type: 'range', min: low, max: high, step: (high - low) / 400 || 1, value, name });
    const output = make('output', label);
    const show = () => { output.textContent = `${short(+input.value)} ${unit}`; };
    let sent = 0;
    input.oninput = () => { show(); clearTimeout(sent); sent = setTimeout(() => act(+input.value), 60); };
    input.ondblclick = () => { input.value = low < 0 ? 0 : value; input.oninput(); };
    show();
    return { get: () => +input.value, set: (v) => { if (document.activeElement !== input) { input.value = v; show(); } } };
  }
  key(event, down) {
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (!KEYS[key] || event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target, arrow = key.startsWith('Arrow');
    if (target.matches?.('input:not([type=range]), textarea, [contenteditable]') || (arrow && target.matches?.('input, [role=tab]'))) return;
    event.preventDefault();
    if (down === this.held.has(key)) return;
    if (down) this.held.add(key); else this.held.delete(key);
    this.send();
  }
  axes() {
    const axes = [0, 0, 0];
    for (const key of this.held) axes[KEYS[key][0]] += KEYS[key][1];
    for (const pad of navigator.getGamepads?.() || []) if (pad) {
      const dead = (v) => (Math.abs(v) < 0.12 ? 0 : v);
      axes[0] -= dead(pad.axes[1] || 0); axes[1] -= dead(pad.axes[0] || 0); axes[2] -= dead(pad.axes[2] || 0);
    }
    return axes.map((v) => Math.max(-1, Math.min(1, v)));
  }
  send() {
    if (this.socket?.readyState === 1) this.socket.send(JSON.stringify({ axes: this.axes(), level: this.level.get() }));
  }
  keep(f) {
    this.strip.push(f); if (this.strip.length > STRIP) this.strip.shift();
    const last = this.trail[this.trail.length - 1];
    if (!last || Math.hypot(last[0] - f[1], last[1] - f[2]) > 0.005) this.trail.push([f[1], f[2]]);
    if (this.trail.length > 3000) this.trail.shift();
    if ([...(navigator.getGamepads?.() || [])].some(Boolean)) this.send();
  }
  wheel(f, k, what) { return f[HEAD + what * this.robot.azimuth.length + k]; }
  paint() {
    if (!this.alive) return;
    if (this.newest && this.drawn !== this.newest) { this.drawn = this.newest; this.painted++; this.above(this.newest); this.lines(); this.words(this.newest); }
    requestAnimationFrame(() => this.paint());
  }
  above(f) {
    const size = Math.min(this.canvas.parentElement.clientWidth, 460), g = sharp(this.canvas, this.canvas.parentElement.clientWidth, size);
    const width = this.canvas.parentElement.clientWidth, reach = Math.max(...this.robot.distance) * 6, scale = size / 2 / reach;
    // Forward is up, left is left; the picture follows the robot
    const at = (x, y) => [width / 2 - (y - f[2]) * scale, size / 2 - (x - f[1]) * scale];
    g.strokeStyle = css('--line'); g.lineWidth = 1;
    const cell = [0.05, 0.1, 0.2, 0.5, 1, 2, 5].find((c) => c * scale > 40) || 10;
    for (let k = Math.floor((f[1] - reach) / cell); k * cell < f[1] + reach; k++) { const [, y] = at(k * cell, 0); g.beginPath(); g.moveTo(0, y); g.lineTo(width, y); g.stroke(); }
    const side = width / 2 / scale;
    for (let k = Math.floor((f[2] - side) / cell); k * cell < f[2] + side; k++) { const [x] = at(0, k * cell); g.beginPath(); g.moveTo(x, 0); g.lineTo(x, size); g.stroke(); }
    g.strokeStyle = css('--c5'); g.lineWidth = 2; g.beginPath();
    for (const [x, y] of this.trail) g.lineTo(...at(x, y));
    g.stroke();
    const turn = (x, y) => [f[1] + x * Math.cos(f[3]) - y * Math.sin(f[3]), f[2] + x * Math.sin(f[3]) + y * Math.cos(f[3])];
    g.fillStyle = css('--soft'); g.strokeStyle = css('--ink'); g.lineWidth = 1.5;
    g.beginPath(); g.arc(width / 2, size / 2, Math.max(...this.robot.distance) * 0.9 * scale, 0, 7); g.fill(); g.stroke();
    g.beginPath(); g.moveTo(...at(f[1], f[2])); g.lineTo(...at(...turn(this.robot.distance[0] * 0.7, 0))); g.stroke();
    const most = this.robot.most = Math.max(this.robot.most || 1e-9, ...this.robot.azimuth.map((_, k) => Math.abs(this.wheel(f, k, 4))));
    this.robot.azimuth.forEach((azimuth, k) => {
      const angle = azimuth * Math.PI / 180, b = this.robot.distance[k], r = this.robot.radius[k];
      const cx = b * Math.cos(angle), cy = b * Math.sin(angle), tx = -Math.sin(angle), ty = Math.cos(angle);
      const sticks = this.wheel(f, k, 3) === 0;
      g.strokeStyle = css(sticks ? '--c1' : '--c0'); g.lineWidth = 9; g.lineCap = 'round';
      g.setLineDash(sticks ? [4, 9] : []);
      g.beginPath(); g.moveTo(...at(...turn(cx - tx * r, cy - ty * r))); g.lineTo(...at(...turn(cx + tx * r, cy + ty * r))); g.stroke();
      g.setLineDash([]);
      const force = this.wheel(f, k, 4) / most * b * 1.2;
      g.strokeStyle = css('--c2'); g.lineWidth = 3;
      g.beginPath(); g.moveTo(...at(...turn(cx, cy))); g.lineTo(...at(...turn(cx + tx * force, cy + ty * force))); g.stroke();
      g.fillStyle = css('--ink'); g.textAlign = 'center'; g.textBaseline = 'middle';
      g.fillText(String(k + 1), ...at(...turn(cx * 1.35, cy * 1.35)));
    });
    g.lineCap = 'butt';
    g.fillStyle = css('--ink'); g.textAlign = 'left'; g.textBaseline = 'alphabetic';
    g.fillText(`grid ${cell} m`, 8, size - 8);
    g.fillStyle = css('--c2'); g.fillText('force of a wheel', 8, 16);
    g.fillStyle = css('--c0'); g.fillText('wheel turns', 8, 32);
    g.fillStyle = css('--c1'); g.fillText('wheel sticks (dotted)', 8, 48);
  }
  words(f) {
    const still = f[4] === 0 && f[5] === 0 && f[6] === 0;
    this.state.textContent = `${still ? 'holds still' : 'moves'}: forward ${f[4].toFixed(3)} m/s, left ${f[5].toFixed(3)} m/s, turn ${f[6].toFixed(3)} rad/s`;
    this.dataset.still = still; this.dataset.vx = f[4]; this.dataset.x = f[1];
  }
  lines() {
    const n = this.robot.azimuth.length, width = this.clientWidth, names = this.robot.azimuth.map((_, k) => String(k + 1));
    const wheels = (what) => names.map((_, k) => (f) => this.wheel(f, k, what));
    const panels = [['voltage of wheel [V]', names, wheels(1)], ['current of wheel [A]', names, wheels(2)], ['speed of wheel [rad/s]', names, wheels(3)],
      ['body [m/s, rad/s]', ['forward', 'left', 'turn'], [4, 5, 6].map((k) => (f) => f[k])]];
    const high = 84, gap = 22, g = sharp(this.strips, width, panels.length * (high + gap) + 40), inner = width - LEFT - RIGHT;
    const end = this.newest[0], begin = end - STRIP / 60, x = (t) => LEFT + (t - begin) / (end - begin) * inner;
    panels.forEach(([title, labels, gets], p) => {
      const top = 20 + p * (high + gap);
      let most = 1e-6;
      for (const f of this.strip) for (const get of gets) most = Math.max(most, Math.abs(get(f)));
      most *= 1.08;
      const y = (v) => top + high / 2 - v / most * high / 2;
      g.strokeStyle = css('--line'); g.lineWidth = 1;
      g.fillStyle = css('--quiet'); g.textAlign = 'right'; g.textBaseline = 'middle';
      for (const v of ticks(-most, most, 5)) { g.beginPath(); g.moveTo(LEFT, y(v)); g.lineTo(LEFT + inner, y(v)); g.stroke(); g.fillText(short(v), LEFT - 5, y(v)); }
      gets.forEach((get, k) => {
        g.strokeStyle = css(`--c${k % 6}`); g.lineWidth = 1.4; g.beginPath();
        for (const f of this.strip) if (f[0] >= begin) g.lineTo(x(f[0]), y(get(f)));
        g.stroke();
      });
      g.strokeStyle = css('--quiet'); g.strokeRect(LEFT + 0.5, top + 0.5, inner, high);
      g.fillStyle = css('--ink'); g.textAlign = 'left'; g.textBaseline = 'bottom'; g.fillText(title, LEFT, top - 3);
      let at = LEFT + g.measureText(title).width + 14;
      labels.forEach((name, k) => { g.fillStyle = css(`--c${k % 6}`); g.fillRect(at, top - 10, 12, 3); g.fillStyle = css('--ink'); g.fillText(name, at + 16, top - 3); at += 26 + g.measureText(name).width; });
    });
    const bottom = 20 + panels.length * (high + gap) - gap;
    g.fillStyle = css('--quiet'); g.textAlign = 'center'; g.textBaseline = 'top';
    for (const t of ticks(begin, end, inner / 90)) if (t >= 0) g.fillText(short(t), x(t), bottom + 4);
    g.fillText('time [s]', LEFT + inner / 2, bottom + 18);
  }
}

document.documentElement.lang = 'en';
customElements.define('omni-drop', Drop);
customElements.define('omni-plot', Plot);
customElements.define('omni-drive', Drive);

import { LEFT, RIGHT, css, make, save, sharp, short, socketUrl, ticks } from './draw.js';

const KEYS = { w: [0, 1], s: [0, -1], a: [1, 1], d: [1, -1], q: [2, 1], e: [2, -1],
  ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [1, 1], ArrowRight: [1, -1] };
const PADS = [['q', 'turn left'], ['w', 'forward'], ['e', 'turn right'], ['a', 'left'], ['s', 'back'], ['d', 'right']];
const VARIED = { floor: ['floor: times the friction', ''], payload: ['load', 'kg'], tilt: ['slope', ''], battery: ['battery', 'V'] };
const HEAD = 11, STRIP = 600; // numbers of a frame before those of the wheels; frames of a strip

// The robot from above, driven by keys, sliders and a gamepad
class Drive extends HTMLElement {
  connectedCallback() {
    if (!this.canvas) this.build();
    this.socket = new WebSocket(socketUrl('/drive'));
    this.socket.binaryType = 'arraybuffer';
    this.received = 0; this.painted = 0;
    this.socket.onmessage = (e) => { this.newest = new Float32Array(e.data, 4); this.received++; this.keep(this.newest); if (this.received % 6 === 0) this.give({ seen: this.received }); };
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
    if (this.sliders) this.follow();
  }
  build() {
    this.held = new Set(); this.trail = []; this.strip = []; this.offset = this.robot.wheels.map(() => 0);
    const stage = make('div', this, { className: 'stage' }), left = make('div', stage), right = make('div', stage);
    this.canvas = make('canvas', left, { tabIndex: 0 });
    this.canvas.setAttribute('role', 'img'); this.canvas.setAttribute('aria-label', 'The robot from above');
    this.state = make('div', left, { className: 'state' });
    this.pads(make('div', left, { className: 'pads' }));
    const unit = this.robot.unit;
    make('h2', right, { textContent: 'Keys' });
    this.level = this.slider(right, `level of a key`, unit, 0, this.robot.limit, Math.min(this.robot.limit, this.robot.limit / 2), () => this.send(), 'level');
    this.note = make('div', right, { className: 'state', id: 'breakaway' });
    make('h2', right, { textContent: 'Each wheel' });
    this.robot.wheels.forEach((_, k) => this.slider(right, `wheel ${k + 1}`, unit, -this.robot.limit, this.robot.limit, 0,
      (v) => { this.offset[k] = v; this.give({ offset: this.offset }); }, `wheel-${k + 1}`));
    make('h2', right, { textContent: 'Change while it moves' });
    this.varied = {};
    for (const [kind, [words, of]] of Object.entries(VARIED)) {
      const act = (v) => this.give({ vary: { [kind]: v } }), names = this.robot.names[kind], range = this.robot.ranges[kind];
      if (names) this.varied[`${kind} by name`] = this.choice(right, `${kind === 'tilt' ? 'slope' : kind} by name`, names, act, `${kind}-name`);
      if (range) this.varied[kind] = this.slider(right, words, of, ...range, act, kind).set;
    }
    this.numbers = make('div', right);
    this.follow();
    this.strips = make('canvas', this);
    this.strips.setAttribute('role', 'img'); this.strips.setAttribute('aria-label', 'The last ten seconds');
    const tools = make('div', this, { className: 'tools' });
    make('button', tools, { type: 'button', textContent: 'Save picture', onclick: () => save(this.strips, 'drive.png') });
  }
  // Show the robot as it is now: another page, or a floor, may have changed it
  follow() {
    const { numbers, varied, ranges, breakaway, unit } = this.robot, keys = numbers.map((n) => n.key).join();
    if (keys !== this.keys) {
      this.keys = keys; this.sliders = {}; this.numbers.replaceChildren();
      for (const n of numbers)
        this.sliders[n.key] = this.slider(this.numbers, n.words, n.unit, 0, n.value > 0 ? 4 * n.value : 1, n.value, (v) => this.give({ set: { [n.key]: v } }), n.key).set;
    }
    for (const n of numbers) this.sliders[n.key](n.value);
    for (const [kind, choice] of Object.entries(varied)) {
      const named = typeof choice === 'string';
      this.varied[`${kind} by name`]?.(named ? choice : '');
      this.varied[kind]?.(named ? ranges[kind][2] : choice);
    }
    this.note.textContent = breakaway.every((v) => v === null) ? ''
      : `moves from ${['forward', 'sideways', 'turning'].map((n, k) => `${n} ${breakaway[k] === null ? '-' : +breakaway[k].toPrecision(3)} ${unit}`).join(', ')}`;
  }
  // Buttons to hold down, where there is no keyboard
  pads(parent) {
    for (const [key, words] of PADS) {
      const pad = make('button', parent, { type: 'button', innerHTML: `<b>${key.toUpperCase()}</b> ${words}` });
      const hold = (on) => { if (on === this.held.has(key)) return; if (on) this.held.add(key); else this.held.delete(key); this.send(); };
      pad.onpointerdown = (e) => { if (pad.hasPointerCapture?.(e.pointerId) === false) pad.setPointerCapture(e.pointerId); hold(true); };
      pad.onpointerup = pad.onpointercancel = pad.onlostpointercapture = () => hold(false);
      pad.onkeydown = (e) => { if (e.key === ' ' || e.key === 'Enter') { e.preventDefault(); hold(true); } };
      pad.onkeyup = pad.onblur = () => hold(false);
      pad.oncontextmenu = (e) => e.preventDefault();
    }
  }
  choice(parent, words, names, act, name) {
    const row = make('div', parent, { className: 'slider' });
    make('span', row, { textContent: words });
    const select = make('select', row, { name });
    select.setAttribute('aria-label', words);
    for (const value of ['', ...names]) make('option', select, { value, textContent: value || 'as in the file' });
    select.onchange = () => act(select.value);
    return (v) => { select.value = v; };
  }
  slider(parent, words, unit, low, high, value, act, name) {
    const row = make('div', parent, { className: 'slider' }), step = 10 ** Math.floor(Math.log10((high - low) / 200));
    make('span', row, { textContent: words });
    const by = (sign, title) => {
      const button = make('button', row, { type: 'button', textContent: sign > 0 ? '+' : '\u2212', onclick: () => { input.value = +input.value + sign * 10 * step; input.oninput(); } });
      button.setAttribute('aria-label', `${title}: ${words}`);
    };
    by(-1, 'less');
    const input = make('input', row, { type: 'range', min: low, max: high, step, value, name });
    by(1, 'more');
    input.setAttribute('aria-label', words);
    const output = make('output', row);
    const show = (v = +input.value) => { output.textContent = `${short(v)} ${unit}`; };
    let sent = 0;
    input.oninput = () => { show(); clearTimeout(sent); sent = setTimeout(() => act(+input.value), 60); };
    input.ondblclick = () => { input.value = low < 0 ? 0 : value; input.oninput(); };
    show(value);
    return { get: () => +input.value, set: (v) => { if (document.activeElement !== input) { input.value = v; show(v); } } };
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
  give(command) { if (this.socket?.readyState === 1) this.socket.send(JSON.stringify(command)); }
  send() { this.give({ axes: this.axes(), level: this.level.get() }); }
  keep(f) {
    this.strip.push(f); if (this.strip.length > STRIP) this.strip.shift();
    const last = this.trail[this.trail.length - 1];
    if (!last || Math.hypot(last[0] - f[1], last[1] - f[2]) > 0.005) this.trail.push([f[1], f[2]]);
    if (this.trail.length > 3000) this.trail.shift();
    if ([...(navigator.getGamepads?.() || [])].some(Boolean)) this.send();
  }
  wheel(f, k, what) { return f[HEAD + what * this.robot.wheels.length + k]; }
  paint() {
    if (!this.alive) return;
    if (this.newest && this.drawn !== this.newest) { this.drawn = this.newest; this.painted++; this.above(this.newest); this.lines(); this.words(this.newest); }
    requestAnimationFrame(() => this.paint());
  }
  above(f) {
    const size = Math.min(this.canvas.parentElement.clientWidth, 460), g = sharp(this.canvas, this.canvas.parentElement.clientWidth, size);
    const width = this.canvas.parentElement.clientWidth, reach = this.robot.reach * 6, scale = size / 2 / reach;
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
    g.beginPath(); g.arc(width / 2, size / 2, this.robot.reach * 0.9 * scale, 0, 7); g.fill(); g.stroke();
    g.beginPath(); g.moveTo(...at(f[1], f[2])); g.lineTo(...at(...turn(this.robot.reach * 0.7, 0))); g.stroke();
    const most = this.robot.most = Math.max(this.robot.most || 1e-9, ...this.robot.wheels.map((_, k) => Math.abs(this.wheel(f, k, 4))));
    this.robot.wheels.forEach(({ ends: [[ax, ay], [bx, by]], push: [tx, ty] }, k) => {
      const cx = (ax + bx) / 2, cy = (ay + by) / 2;
      const sticks = this.wheel(f, k, 3) === 0;
      g.strokeStyle = css(sticks ? '--c1' : '--c0'); g.lineWidth = 9; g.lineCap = 'round';
      g.setLineDash(sticks ? [4, 9] : []);
      g.beginPath(); g.moveTo(...at(...turn(ax, ay))); g.lineTo(...at(...turn(bx, by))); g.stroke();
      g.setLineDash([]);
      const force = this.wheel(f, k, 4) / most * this.robot.reach * 1.2;
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
    this.dataset.still = still; this.dataset.vx = f[4]; this.dataset.x = f[1]; this.dataset.friction = f[8];
  }
  lines() {
    const n = this.robot.wheels.length, width = this.clientWidth, names = this.robot.wheels.map((_, k) => String(k + 1));
    const wheels = (what) => names.map((_, k) => (f) => this.wheel(f, k, what));
    const panels = [['voltage of wheel [V]', names, wheels(1)], ['current of wheel [A]', names, wheels(2)], ['speed of wheel [rad/s]', names, wheels(3)],
      ['body [m/s, rad/s]', ['forward', 'left', 'turn'], [4, 5, 6].map((k) => (f) => f[k])],
      ['friction [N, N m]', ['forward', 'left', 'turn'], [8, 9, 10].map((k) => (f) => f[k])]];
    const high = 84, gap = 22, g = sharp(this.strips, width, panels.length * (high + gap) + 40), inner = width - LEFT - RIGHT;
    const end = this.newest[0], begin = end - STRIP / 60, x = (t) => LEFT + (t - begin) / (end - begin) * inner;
    panels.forEach(([title, labels, gets], p) => {
      const top = 20 + p * (high + gap);
      let most = 0.01; // what rests is no noise
      for (const f of this.strip) for (const get of gets) most = Math.max(most, Math.abs(get(f)) || 0);
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

customElements.define('omni-drive', Drive);

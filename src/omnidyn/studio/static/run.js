import { Picture, css, grid, line, make, sharp, socketUrl } from './draw.js';

const BEAT = 50, HIGH = 460; // [ms] between two words of a key that is held; pixels of the room at most
const TAKES_SPACE = 'input, textarea, select, button, a, [contenteditable], [tabindex]:not(body)'; // beside the button that is held

const fixed = (value, digits) => (Math.round(value * 10 ** digits) / 10 ** digits + 0).toFixed(digits); // no -0

// A plan in its room, driven while the space bar, or the button, is held. What lets go: release, another window, another
// tab, a page that is hidden or gone.
class Run extends Picture {
  static observedAttributes = ['data-course', 'data-stage'];
  connectedCallback() {
    super.connectedCallback();
    this.connect();
    this.down = (e) => this.key(e, true); this.up = (e) => this.key(e, false); this.away = () => this.release();
    addEventListener('keydown', this.down); addEventListener('keyup', this.up);
    addEventListener('blur', this.away); addEventListener('pagehide', this.away); document.addEventListener('visibilitychange', this.away);
  }
  disconnectedCallback() {
    super.disconnectedCallback();
    this.release(); this.gone = true; this.socket.close();
    removeEventListener('keydown', this.down); removeEventListener('keyup', this.up);
    removeEventListener('blur', this.away); removeEventListener('pagehide', this.away); document.removeEventListener('visibilitychange', this.away);
  }
  connect() {
    this.gone = false;
    this.socket = new WebSocket(socketUrl('/planned'));
    this.socket.onmessage = (e) => { this.frame = JSON.parse(e.data); this.follow(); };
    this.socket.onclose = () => { this.release(); if (!this.gone) setTimeout(() => this.isConnected && this.connect(), 1000); };
  }
  attributeChangedCallback(name) {
    if (name === 'data-course') {
      const text = this.dataset.course;
      if (text === this.text) return;
      this.text = text; this.course = JSON.parse(text); this.frame = null; this.trail = [];
    } else if (this.dataset.stage === 'running' && this.stage !== 'running') { this.frame = null; this.trail = []; }
    const before = this.stage;
    this.stage = this.dataset.stage;
    if (!this.canvas) return;
    this.follow();
    if (this.stage === 'ready' && before !== 'ready') this.focusKey();
  }
  build() {
    this.trail = this.trail || [];
    this.now = make('p', this, { className: 'now', id: 'now' }); this.now.setAttribute('role', 'status');
    this.then = make('p', this, { className: 'quiet', id: 'then' });
    this.button = make('button', this, { type: 'button', className: 'hold', id: 'hold' });
    this.button.onpointerdown = (e) => { this.button.setPointerCapture?.(e.pointerId); this.press(); };
    this.button.onpointerup = this.button.onpointercancel = this.button.onlostpointercapture = () => this.release();
    this.button.oncontextmenu = (e) => e.preventDefault();
    this.bar = make('div', make('div', this, { className: 'driven' }));
    this.picture('The room from above: the way that is planned, and the robot');
    const legend = make('div', this, { className: 'tools' });
    for (const [words, colour] of [['border', '--ink'], ['planned', '--quiet'], ['this move, and its end', '--c0'], ['driven', '--c1']]) {
      const entry = make('span', legend);
      make('i', entry).style.background = `var(${colour})`;
      entry.append(words);
    }
    this.place = make('p', this, { className: 'state', id: 'place' });
    this.follow();
    this.focusKey();
  }
  // Space, where nothing else takes it; its release counts wherever it is
  key(event, down) {
    const own = event.target === this.button || !event.target.closest?.(TAKES_SPACE);
    if (event.key !== ' ' || (down && (!own || event.ctrlKey || event.metaKey || event.altKey || !this.offsetParent))) return;
    if (own) event.preventDefault();
    if (!down) this.release(); else if (!event.repeat) this.press();
  }
  // The space bar is its own, where nothing has the focus
  focusKey() { if (this.offsetParent && document.activeElement === document.body) this.button.focus({ preventScroll: true }); }
  press() {
    if (this.held || this.stage !== 'ready' || this.socket.readyState !== 1) return;
    this.held = true;
    this.say({ pressed: true, held: true });
    this.beat = setInterval(() => (this.offsetParent && !document.hidden ? this.say({ held: true }) : this.release()), BEAT);
    this.follow();
  }
  release() {
    if (!this.held) return;
    this.held = false; clearInterval(this.beat);
    this.say({ held: false });
    this.follow();
  }
  say(words) { if (this.socket.readyState === 1) this.socket.send(JSON.stringify(words)); }
  // Words beside the picture, and the picture
  follow() {
    const c = this.course, stage = this.stage;
    if (!c || !this.canvas) return;
    const row = this.frame ? this.frame[0] : 0, legs = c.legs;
    this.leg = Math.max(0, legs.findIndex(([, end]) => row < end));
    const over = stage === 'done' || row >= legs[legs.length - 1][1], of = (k) => `move ${k + 1} of ${legs.length}: ${legs[k][2]}`;
    this.now.textContent = over ? 'All of it is driven.' : `${{ running: 'Now', stopped: 'Stopped in' }[stage] || 'Next'} ${of(this.leg)}`;
    this.then.textContent = over || stage === 'stopped' || this.leg + 1 >= legs.length ? '' : `Then ${of(this.leg + 1)}`;
    this.button.textContent = stage === 'running' ? (this.held ? 'It drives: let go to stop' : 'Driven from another page')
      : stage === 'ready' ? 'Hold the space bar, or this button, to drive' : stage === 'done' ? 'Driven' : 'Stopped';
    this.button.disabled = stage !== 'ready' && stage !== 'running';
    this.button.classList.toggle('on', stage === 'running'); this.button.hidden = stage === 'done';
    this.bar.style.width = `${Math.min(100 * row * c.row_s / c.seconds, 100)}%`;
    const [x, y, heading] = this.frame ? this.frame.slice(1) : [0, 0, 0];
    this.place.textContent = `${Math.min(row * c.row_s, c.seconds).toFixed(1)} of ${c.seconds.toFixed(1)} s; the robot is at ${fixed(x, 2)} m, ${fixed(y, 2)} m, ${fixed(heading * 180 / Math.PI, 0)}\u00b0`
      + (stage === 'ready' && !this.frame ? ': put it into the middle of the room, along x' : '');
    const last = this.trail[this.trail.length - 1];
    if (this.frame && (!last || Math.hypot(last[0] - x, last[1] - y) > 0.005)) this.trail.push([x, y]);
    this.dataset.row = row; this.dataset.held = !!this.held;
    this.draw();
  }
  draw() {
    const c = this.course, width = this.clientWidth;
    if (!c || !this.canvas || !width) return;
    const edge = 0.08 * Math.max(...c.area) + c.reach, wide = c.area[0] + 2 * edge, high = c.area[1] + 2 * edge;
    const scale = Math.min(width / wide, HIGH / high), height = high * scale, left = [-width / 2 / scale, -high / 2];
    const g = sharp(this.canvas, width, height + 16), at = (x, y) => [(x - left[0]) * scale, height - (y - left[1]) * scale];
    grid(g, width, height + 16, at, scale, [left[0], left[1] - 16 / scale]);
    const [ax, ay] = at(-c.area[0] / 2, c.area[1] / 2);
    g.strokeStyle = css('--ink'); g.lineWidth = 3; g.strokeRect(ax, ay, c.area[0] * scale, c.area[1] * scale);
    g.lineJoin = 'round'; g.strokeStyle = css('--quiet'); g.globalAlpha = 0.5; g.lineWidth = 1.5; line(g, c.way, at); g.globalAlpha = 1;
    const [first, end, , pose] = c.legs[this.leg], part = c.way.filter((_, k) => c.rows[k] >= first && c.rows[k] <= end);
    if (this.stage !== 'done') {
      g.strokeStyle = css('--c0'); g.globalAlpha = 0.45; g.lineWidth = 7; line(g, part, at); g.globalAlpha = 1;
      g.fillStyle = css('--c0'); g.beginPath(); g.arc(...at(pose[0], pose[1]), 5, 0, 7); g.fill();
    }
    g.strokeStyle = css('--c1'); g.lineWidth = 2; line(g, this.trail, at);
    this.robot(g, this.frame ? this.frame.slice(1) : [0, 0, 0], at, scale);
  }
  robot(g, [x, y, heading], at, scale) {
    const c = Math.cos(heading), s = Math.sin(heading), seen = ([a, b]) => at(x + a * c - b * s, y + a * s + b * c), reach = this.course.reach * 0.9;
    g.strokeStyle = css('--ink'); g.lineWidth = 2;
    g.beginPath(); g.arc(...at(x, y), reach * scale, 0, 7); g.stroke();
    g.beginPath(); g.moveTo(...at(x, y)); g.lineTo(...seen([reach, 0])); g.stroke();
    g.lineWidth = 4;
    for (const [a, b] of this.course.wheels) { g.beginPath(); g.moveTo(...seen(a)); g.lineTo(...seen(b)); g.stroke(); }
  }
}

customElements.define('omni-run', Run);

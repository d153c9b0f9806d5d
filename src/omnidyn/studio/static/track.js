import { Picture, css, grid, line, make, save, sharp } from './draw.js';

// Robots on their path: play, pause, scrub
class Track extends Picture {
  static observedAttributes = ['data-motion'];
  connectedCallback() { super.connectedCallback(); this.load(); }
  disconnectedCallback() { super.disconnectedCallback(); this.playing = false; }
  attributeChangedCallback() { if (this.canvas) this.load(); }
  build() {
    this.frame = 0;
    this.picture('Robots on their path, from above');
    const tools = make('div', this, { className: 'tools' });
    this.button = make('button', tools, { type: 'button', textContent: 'Play', onclick: () => this.play(!this.playing) });
    this.scrub = make('input', tools, { type: 'range', min: 0, max: 0, value: 0, name: 'time' });
    this.scrub.setAttribute('aria-label', 'time');
    this.scrub.oninput = () => { this.play(false); this.show(+this.scrub.value); };
    this.state = make('span', tools, { className: 'state' });
    make('button', tools, { type: 'button', textContent: 'Save picture', onclick: () => save(this.canvas, 'track.png') });
  }
  async load() {
    const answer = await fetch(`/track/motion.json?of=${this.dataset.motion}`);
    if (answer.status !== 200) return;
    this.motion = await answer.json();
    this.scrub.max = this.motion.t.length - 1;
    this.show(0);
  }
  play(on) {
    this.playing = on; this.button.textContent = on ? 'Pause' : 'Play';
    if (!on || !this.motion) return;
    const t = this.motion.t, from = this.frame >= t.length - 1 ? 0 : this.frame, begun = performance.now();
    let k = from;
    const step = () => {
      if (!this.playing) return;
      const now = t[from] + (performance.now() - begun) / 1000;
      while (k < t.length - 1 && t[k] < now) k++;
      this.show(k);
      if (k < t.length - 1) requestAnimationFrame(step); else this.play(false);
    };
    requestAnimationFrame(step);
  }
  show(frame) {
    this.frame = frame; this.scrub.value = frame;
    const m = this.motion;
    this.state.textContent = `${m.t[frame].toFixed(2)} s: ${m.names.map((name, k) => `${name} ${m.distance[k][frame].toFixed(3)} mm off`).join(', ')}`;
    this.draw();
  }
  draw() {
    const m = this.motion, width = this.clientWidth;
    if (!m || !width) return;
    // The path and the robots on it; who runs away does not shrink the rest
    const edge = 1.5 * m.reach, xs = m.path.map((p) => p[0]), ys = m.path.map((p) => p[1]);
    const low = [Math.min(...xs) - edge, Math.min(...ys) - edge], high = [Math.max(...xs) + edge, Math.max(...ys) + edge];
    const scale = Math.min(width / (high[0] - low[0]), 460 / (high[1] - low[1])), height = Math.max(160, (high[1] - low[1]) * scale);
    const left = [(low[0] + high[0]) / 2 - width / 2 / scale, (low[1] + high[1]) / 2 - height / 2 / scale];
    const g = sharp(this.canvas, width, height), at = (x, y) => [(x - left[0]) * scale, height - (y - left[1]) * scale];
    grid(g, width, height, at, scale, left);
    g.lineJoin = 'round';
    g.strokeStyle = css('--quiet'); g.globalAlpha = 0.35; g.lineWidth = 6; line(g, m.path, at); g.globalAlpha = 1;
    m.poses.forEach((poses, k) => {
      g.strokeStyle = css(`--c${k % 6}`); g.lineWidth = 1.5;
      g.setLineDash([[], [8, 4], [2, 3], [10, 3, 2, 3]][k % 4]); line(g, poses.slice(0, this.frame + 1), at); g.setLineDash([]);
      this.robot(g, poses[this.frame], at, scale, css(`--c${k % 6}`));
    });
    const [x, y] = at(...m.path[this.frame]);
    g.fillStyle = css('--ink'); g.beginPath(); g.arc(x, y, 4, 0, 7); g.fill();
    g.textAlign = 'left'; g.textBaseline = 'middle';
    m.names.forEach((name, k) => { g.fillStyle = css(`--c${k % 6}`); g.fillRect(8, 14 + 18 * k, 16, 3); g.fillStyle = css('--ink'); g.fillText(name, 30, 16 + 18 * k); });
    g.beginPath(); g.arc(16, 16 + 18 * m.names.length, 4, 0, 7); g.fill(); g.fillText('where the path is', 30, 16 + 18 * m.names.length);
  }
  robot(g, [x, y, heading], at, scale, colour) {
    const c = Math.cos(heading), s = Math.sin(heading), seen = ([a, b]) => at(x + a * c - b * s, y + a * s + b * c);
    g.strokeStyle = colour; g.lineWidth = 2;
    g.beginPath(); g.arc(...at(x, y), this.motion.reach * 0.9 * scale, 0, 7); g.stroke();
    g.beginPath(); g.moveTo(...at(x, y)); g.lineTo(...seen([this.motion.reach * 0.9, 0])); g.stroke();
    g.strokeStyle = css('--ink'); g.lineWidth = 4;
    for (const [a, b] of this.motion.wheels) { g.beginPath(); g.moveTo(...seen(a)); g.lineTo(...seen(b)); g.stroke(); }
  }
}

const WIDE = 3, HIGH = 2, NEAR = 0.02, STEP = 0.1, MOST = 2000; // metres that are shown, between two points, of an arrow key; points

// A place to draw a path: by mouse or touch, or by arrow keys and Enter
class Drawing extends Picture {
  build() {
    this.points = JSON.parse(this.dataset.points || '[]'); this.pen = [0, 0];
    this.picture('A path to draw. Arrow keys move the pen, Enter sets a point, Backspace takes it away');
    const c = this.canvas;
    c.tabIndex = 0;
    const tools = make('div', this, { className: 'tools' });
    make('button', tools, { type: 'button', textContent: 'Clear', onclick: () => { this.points = []; this.tell(); } });
    make('span', tools, { textContent: 'Draw by mouse or touch, or by arrow keys and Enter' });
    c.onpointerdown = (e) => { c.setPointerCapture(e.pointerId); this.points = []; this.down = true; this.add(this.place(e)); };
    c.onpointermove = (e) => { if (this.down) this.add(this.place(e)); };
    c.onpointerup = c.onpointercancel = () => { if (this.down) { this.down = false; this.tell(); } };
    c.onkeydown = (e) => {
      const steps = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] }, step = steps[e.key];
      if (!step && e.key !== 'Enter' && e.key !== 'Backspace') return;
      e.preventDefault();
      if (step) { this.pen = this.pen.map((v, k) => +Math.max(-[WIDE, HIGH][k] / 2, Math.min([WIDE, HIGH][k] / 2, v + step[k])).toFixed(3)); this.draw(); return; }
      if (e.key === 'Enter') this.add(this.pen); else this.points.pop();
      this.tell();
    };
  }
  scale() { return this.canvas.clientWidth / WIDE; }
  place(e) { return [+(e.offsetX / this.scale() - WIDE / 2).toFixed(3), +(HIGH / 2 - e.offsetY / this.scale()).toFixed(3)]; }
  add(point) {
    const last = this.points[this.points.length - 1];
    if (this.points.length < MOST && (!last || Math.hypot(last[0] - point[0], last[1] - point[1]) >= NEAR)) this.points.push([...point]);
    this.draw();
  }
  tell() { this.draw(); this.dispatchEvent(new CustomEvent('drawn', { detail: this.points })); }
  draw() {
    if (!this.canvas || !this.clientWidth) return;
    const width = Math.min(this.clientWidth, 720), scale = width / WIDE, height = HIGH * scale;
    this.canvas.style.width = `${width}px`;
    const g = sharp(this.canvas, width, height), at = (x, y) => [(x + WIDE / 2) * scale, (HIGH / 2 - y) * scale];
    grid(g, width, height, at, scale, [-WIDE / 2, -HIGH / 2]);
    g.strokeStyle = css('--c0'); g.lineWidth = 3; g.lineJoin = 'round'; line(g, this.points, at);
    g.fillStyle = css('--c0');
    if (this.points.length) { g.beginPath(); g.arc(...at(...this.points[0]), 5, 0, 7); g.fill(); }
    const [x, y] = at(...this.pen);
    g.strokeStyle = css('--c1'); g.lineWidth = 1.5;
    g.beginPath(); g.moveTo(x - 7, y); g.lineTo(x + 7, y); g.moveTo(x, y - 7); g.lineTo(x, y + 7); g.stroke();
    g.strokeStyle = css('--quiet'); g.strokeRect(0.5, 0.5, width - 1, height - 1);
    this.dataset.count = this.points.length;
  }
}

customElements.define('omni-track', Track);
customElements.define('omni-path', Drawing);

// Drawing on a canvas, and small helpers

export const css = (name) => getComputedStyle(document.body).getPropertyValue(name).trim();
export const socketUrl = (path) => `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}${path}`;
export const make = (tag, parent, more = {}) => parent.appendChild(Object.assign(document.createElement(tag), more));
export const short = (x) => (x === 0 ? '0' : Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3 ? x.toExponential(1) : String(+x.toPrecision(4)));

export const LEFT = 62, RIGHT = 10; // margins of a plot

// Round numbers between two ends, about so many
export function ticks(low, high, count) {
  const raw = (high - low) / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= raw) || power;
  const marks = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) marks.push(k * step);
  return marks;
}

// A canvas as sharp as the screen; gives back its context in CSS pixels
export function sharp(canvas, width, height) {
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

export function save(canvas, name) {
  const copy = document.createElement('canvas');
  copy.width = canvas.width; copy.height = canvas.height;
  const g = copy.getContext('2d');
  g.fillStyle = css('--paper'); g.fillRect(0, 0, copy.width, copy.height); g.drawImage(canvas, 0, 0);
  const link = document.createElement('a');
  link.href = copy.toDataURL('image/png'); link.download = name; link.click();
}

// A grid, and how metres become pixels: x to the right, y up
export function grid(g, width, height, at, scale, low) {
  const cell = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10].find((c) => c * scale > 40) || 20;
  g.strokeStyle = css('--line'); g.lineWidth = 1;
  for (let k = Math.floor(low[0] / cell); k * cell < low[0] + width / scale; k++) { const [x] = at(k * cell, 0); g.beginPath(); g.moveTo(x, 0); g.lineTo(x, height); g.stroke(); }
  for (let k = Math.floor(low[1] / cell); k * cell < low[1] + height / scale; k++) { const [, y] = at(0, k * cell); g.beginPath(); g.moveTo(0, y); g.lineTo(width, y); g.stroke(); }
  g.fillStyle = css('--ink'); g.textAlign = 'left'; g.textBaseline = 'alphabetic';
  g.fillText(`grid ${cell} m, x to the right, y up`, 8, height - 8);
}

export function line(g, points, at) { g.beginPath(); for (const [x, y] of points) g.lineTo(...at(x, y)); g.stroke(); }

// An element that draws itself again when its size changes, or the page turns dark
export class Picture extends HTMLElement {
  connectedCallback() {
    if (!this.canvas) this.build();
    const size = new ResizeObserver(() => this.draw()), look = new MutationObserver(() => this.draw());
    size.observe(this); look.observe(document.body, { attributes: true, attributeFilter: ['class'] });
    this.leave = () => { size.disconnect(); look.disconnect(); };
  }
  disconnectedCallback() { this.leave(); }
  picture(words) {
    this.canvas = make('canvas', this);
    this.canvas.setAttribute('role', 'img'); this.canvas.setAttribute('aria-label', words);
  }
}

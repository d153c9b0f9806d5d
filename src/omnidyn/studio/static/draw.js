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

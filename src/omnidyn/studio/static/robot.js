import { css, save, sharp, short, ticks } from './draw.js';

const numbers = (text) => (text || '').split(',').map((part) => parseFloat(part)).filter(Number.isFinite);
const SIZE = 240; // of the picture

// A robot from above, to scale, from the sizes that are typed: forward is up, left is left
class RobotAbove extends HTMLElement {
  static observedAttributes = ['data-azimuth', 'data-wheel-radius', 'data-robot-radius'];
  connectedCallback() {
    if (!this.canvas) {
      this.canvas = this.appendChild(document.createElement('canvas'));
      this.canvas.setAttribute('role', 'img');
      this.canvas.setAttribute('aria-label', 'The robot from above, to scale');
      this.canvas.style.width = `${SIZE}px`;
      this.button = this.appendChild(Object.assign(document.createElement('button'), { type: 'button', textContent: 'Save picture', onclick: () => save(this.canvas, 'robot.png') }));
      this.dark = new MutationObserver(() => this.draw());
      this.dark.observe(document.body, { attributes: true, attributeFilter: ['class'] });
    }
    this.draw();
  }
  attributeChangedCallback() { if (this.canvas) this.draw(); }
  draw() {
    const g = sharp(this.canvas, SIZE, SIZE + 24), azimuth = numbers(this.dataset.azimuth);
    const of = (values, k) => values[k] ?? values[0];
    const radius = numbers(this.dataset.wheelRadius), distance = numbers(this.dataset.robotRadius);
    this.wheels = azimuth.length && radius.length && distance.length ? azimuth.map((angle, k) => [angle, of(radius, k), of(distance, k)]) : [];
    if (!this.wheels.length) return;
    const reach = 1.25 * Math.max(...this.wheels.map(([, r, b]) => Math.hypot(b, r))), scale = SIZE / 2 / reach, middle = SIZE / 2;
    if (!(reach > 0)) return;
    const at = (x, y) => [middle - y * scale, middle - x * scale];
    g.fillStyle = css('--soft'); g.strokeStyle = css('--ink'); g.lineWidth = 1.5;
    g.beginPath(); g.arc(middle, middle, Math.min(...this.wheels.map(([, , b]) => b)) * 0.9 * scale, 0, 7); g.fill(); g.stroke();
    g.beginPath(); g.moveTo(...at(0, 0)); g.lineTo(...at(reach * 0.35, 0)); g.stroke();
    this.wheels.forEach(([angle, r, b], k) => {
      const turn = angle * Math.PI / 180, x = b * Math.cos(turn), y = b * Math.sin(turn), along = [-Math.sin(turn), Math.cos(turn)];
      g.strokeStyle = css('--c0'); g.lineWidth = Math.max(2, 0.5 * r * scale);
      g.beginPath(); g.moveTo(...at(x - along[0] * r, y - along[1] * r)); g.lineTo(...at(x + along[0] * r, y + along[1] * r)); g.stroke();
      g.fillStyle = css('--ink'); g.textAlign = 'center'; g.textBaseline = 'middle';
      g.fillText(String(k + 1), ...at(x * 0.68, y * 0.68));
    });
    const length = ticks(0, reach, 2)[1] || reach;
    g.strokeStyle = css('--quiet'); g.fillStyle = css('--quiet'); g.lineWidth = 2;
    g.beginPath(); g.moveTo(8, SIZE + 6); g.lineTo(8 + length * scale, SIZE + 6); g.stroke();
    g.textAlign = 'left'; g.textBaseline = 'top'; g.fillText(`${short(length)} m`, 8, SIZE + 10);
  }
}

customElements.define('omni-robot', RobotAbove);

// Which part of the plane is seen: fits everybody until somebody moves it by hand.

const LEAST_SPAN_M = 4;
const FILLED = 0.84; // of what is free, when everybody was just fitted
const GLIDE_S = 0.25;
const LARGEST = 4000, SMALLEST = 0.02; // pixels of a metre

export class Camera {
  constructor(canvas) {
    this.canvas = canvas;
    this.x = 0; this.y = 0; this.scale = 40; // the centre in metres, pixels of a metre
    this.target = null;
    this.isFollowing = true;
    this.fingers = new Map();
    this.onTap = () => {};
    this.onMove = () => {};
    this.listen();
  }

  get width() { return this.canvas.clientWidth; }
  get height() { return this.canvas.clientHeight; }

  toX(x) { return this.width / 2 + (x - this.x) * this.scale; }
  toY(y) { return this.height / 2 - (y - this.y) * this.scale; }
  fromX(px) { return this.x + (px - this.width / 2) / this.scale; }
  fromY(py) { return this.y - (py - this.height / 2) / this.scale; }

  follow() { this.isFollowing = true; this.target = null; this.isFirst = true; }

  // box: [left, bottom, right, top] in metres of all that is to be seen
  step(box, seconds) {
    const size = `${this.width}x${this.height}`;
    if (size !== this.size) { this.size = size; if (this.isFollowing) this.isFirst = true; }
    if (this.isFollowing && box && this.isUnfit(box)) this.target = this.fitted(box);
    if (!this.target) return;
    const share = this.isFirst === false ? 1 - Math.exp(-seconds / GLIDE_S) : 1;
    this.isFirst = false;
    for (const name of ["x", "y"]) this[name] += (this.target[name] - this[name]) * share;
    this.scale *= (this.target.scale / this.scale) ** share;
    const isThere = Math.abs(this.target.scale / this.scale - 1) < 0.002
      && Math.hypot(this.target.x - this.x, this.target.y - this.y) * this.scale < 0.5;
    if (isThere) { Object.assign(this, this.target); this.target = null; }
  }

  // what of the canvas is free of buttons and the legend
  get free() {
    const low = this.width < 760 ? 78 : 62;
    return { left: 22, top: 22, right: this.width - 22, bottom: this.height - low };
  }

  fitted([left, bottom, right, top]) {
    const { free } = this, width = Math.max(right - left, LEAST_SPAN_M), height = Math.max(top - bottom, LEAST_SPAN_M);
    const wide = Math.max(40, free.right - free.left), high = Math.max(40, free.bottom - free.top);
    const scale = bounded(Math.min(wide / width, high / height) * FILLED);
    const above = (this.height / 2 - (free.top + free.bottom) / 2) / scale;
    return { x: (left + right) / 2, y: (bottom + top) / 2 - above, scale };
  }

  // does anybody leave the free part, or is everybody small in the middle?
  isUnfit(box) {
    const { x, y, scale } = this.target ?? this, { free } = this;
    const toX = (at) => this.width / 2 + (at - x) * scale, toY = (at) => this.height / 2 - (at - y) * scale;
    return this.isFirst !== false || toX(box[0]) < free.left || toX(box[2]) > free.right || toY(box[3]) < free.top
      || toY(box[1]) > free.bottom || this.fitted(box).scale / scale > 1.6;
  }

  zoom(factor, px, py) {
    const x = this.fromX(px), y = this.fromY(py);
    this.scale = bounded(this.scale * factor);
    this.x += x - this.fromX(px);
    this.y += y - this.fromY(py);
    this.byHand();
  }

  byHand() { this.isFollowing = false; this.target = null; this.isFirst = false; this.onMove(); }

  listen() {
    const { canvas, fingers } = this;
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      this.zoom(Math.exp(-event.deltaY * lines * 0.0015), event.offsetX, event.offsetY);
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
      this.way = fingers.size === 1 ? 0 : Infinity;
    });
    canvas.addEventListener("pointermove", (event) => {
      const finger = fingers.get(event.pointerId);
      if (!finger) return;
      const before = spread(fingers);
      this.way += Math.hypot(event.offsetX - finger.x, event.offsetY - finger.y);
      finger.x = event.offsetX; finger.y = event.offsetY;
      if (this.way < 4) return;
      const after = spread(fingers);
      this.x -= (after.x - before.x) / this.scale;
      this.y += (after.y - before.y) / this.scale;
      if (before.size && after.size) this.zoom(after.size / before.size, after.x, after.y);
      this.byHand();
    });
    const end = (event) => {
      if (fingers.delete(event.pointerId) && !fingers.size && this.way < 4 && event.type === "pointerup") {
        this.onTap(event.offsetX, event.offsetY);
      }
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
  }
}

function bounded(scale) { return Math.min(LARGEST, Math.max(SMALLEST, scale)); }

// the middle of all fingers, and how far two of them are apart
function spread(fingers) {
  const all = [...fingers.values()];
  const sum = all.reduce((to, f) => ({ x: to.x + f.x, y: to.y + f.y }), { x: 0, y: 0 });
  const size = all.length > 1 ? Math.hypot(all[0].x - all[1].x, all[0].y - all[1].y) : 0;
  return { x: sum.x / all.length, y: sum.y / all.length, size };
}

// The paths, drawn onto a layer of their own and kept; and closures, which come and go.
//
// Strokes are what takes time. The layer that is seen is moved and scaled with the camera while
// the next one is drawn behind it, so many strokes in each picture as the computer can bear.

import { PAGE, ofRobot } from "./colours.js";
import { BY_ODOMETRY, turn } from "./team.js";

const APART_PX = 2; // points nearer than this are one
const CURVED_PX = 12; // shorter steps are straight
const STROKE_ROWS = 64; // rows of one stroke: long ones take more than their share
const LEAST_ROWS = 384, MOST_ROWS = 8000; // rows of one picture
const SLOW_S = 0.028, FAST_S = 0.02;
const RECENT_S = 40; // so much of a path is drawn stronger, in steps that fade
const STEPS = 8;
const FRESH_S = 30, OLD_S = 120, REFUSED_S = 600; // how long closures are seen, strongly and at all

class Layer {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.context = this.canvas.getContext("2d");
    this.key = null;
    this.drawn = new Map(); // by robot: how many rows are drawn
    this.isDone = false;
  }

  begin(key, camera, ratio) {
    const { canvas, context } = this, { x, y, scale, width, height } = camera;
    Object.assign(this, { key, ratio, x, y, scale, width, height, isDone: false });
    this.drawn.clear();
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.lineJoin = "round";
  }

  toX(x) { return this.width / 2 + (x - this.x) * this.scale; }
  toY(y) { return this.height / 2 - (y - this.y) * this.scale; }

  // draws up to `rows` more of all paths; how many were left over
  work({ team, ids, until, selected }, rows) {
    for (const id of ids) {
      const { path } = team.robot(id);
      // the newest row still changes: `recent` draws it
      const end = until === null ? path.length - 1 : path.index(until) + 1;
      let from = this.drawn.get(id) ?? 0;
      while (from < end && rows > 0) {
        const to = Math.min(end, from + STROKE_ROWS, from + rows);
        this.stroke(path, Math.max(0, from - 1), to, id, selected);
        rows -= to - from;
        from = to;
      }
      this.drawn.set(id, from);
      if (rows <= 0) return 0;
    }
    this.isDone = true;
    return rows;
  }

  stroke(path, from, end, id, selected) {
    const { context } = this, alpha = selected === null || selected === id ? 0.42 : 0.12;
    context.strokeStyle = ofRobot(id);
    for (let k = from; k < end - 1;) {
      const isOdometry = path.state[k + 1] === BY_ODOMETRY;
      context.beginPath();
      context.globalAlpha = isOdometry ? alpha * 0.8 : alpha;
      context.lineWidth = isOdometry ? 1.2 : 1.8;
      context.setLineDash(isOdometry ? [2, 4] : []);
      k = trace(context, path, k, end, this, (row) => (path.state[row] === BY_ODOMETRY) === isOdometry);
      context.stroke();
    }
  }
}

export class PathLayers {
  constructor() { this.front = new Layer(); this.back = new Layer(); this.rows = 2000; }

  // draws the paths of a scene: those up to `until`, null shows all
  draw(context, scene, camera, ratio, seconds) {
    const { team, ids, until, selected, scheme } = scene;
    const versions = ids.map((id) => `${id}:${team.robot(id).path.version}`).join();
    const key = [camera.x, camera.y, camera.scale, camera.width, camera.height, ratio, until, selected, scheme, versions].join("|");
    if (seconds > SLOW_S) this.rows = Math.max(LEAST_ROWS, this.rows * 0.6);
    else if (seconds < FAST_S) this.rows = Math.min(MOST_ROWS, this.rows * 1.2);
    if (this.front.key === key) this.front.work(scene, Math.round(this.rows));
    else {
      // what was begun is ended first, or a camera that moves would never be shown anything
      if (this.back.key === null || this.back.isDone) this.back.begin(key, camera, ratio);
      this.back.work(scene, Math.round(this.rows));
      if (this.back.isDone) [this.front, this.back] = [this.back, this.front];
    }
    const { front } = this;
    if (front.key === null) return;
    const by = camera.scale / front.scale;
    const left = camera.toX(front.x) - (front.width / 2) * by, top = camera.toY(front.y) - (front.height / 2) * by;
    context.drawImage(front.canvas, left, top, front.width * by, front.height * by);
  }
}

// lines between the places where two robots were when a closure was found
export function closures(context, { team, ids, t, selected }, camera) {
  const shown = new Set(ids), lines = { fresh: [], old: [], refused: [] };
  for (const pair of team.pairs.values()) {
    if (!shown.has(pair.a) || !shown.has(pair.b)) continue;
    const isChosen = selected === pair.a || selected === pair.b;
    if (selected !== null && !isChosen) continue;
    for (const closure of pair.closures.values()) {
      const age = t - closure.t;
      if (age < 0) continue;
      if (!closure.kept) { if (age < REFUSED_S || isChosen) lines.refused.push(closure); }
      else if (age < FRESH_S) lines.fresh.push(closure);
      else if (age < OLD_S || isChosen) lines.old.push(closure);
    }
  }
  const styles = { old: [0.2, PAGE.closure, []], fresh: [0.48, PAGE.closure, []], refused: [0.85, PAGE.bad, [4, 4]] };
  for (const [name, [alpha, colour, dash]] of Object.entries(styles)) {
    context.globalAlpha = alpha;
    context.strokeStyle = context.fillStyle = colour;
    context.lineWidth = 1.2;
    context.setLineDash(dash);
    context.beginPath();
    for (const { xa, ya, xb, yb } of lines[name]) {
      context.moveTo(camera.toX(xa), camera.toY(ya));
      context.lineTo(camera.toX(xb), camera.toY(yb));
    }
    context.stroke();
    context.setLineDash([]);
    if (name === "old") continue;
    context.beginPath();
    for (const { xa, ya, xb, yb } of lines[name]) {
      context.rect(camera.toX(xa) - 2, camera.toY(ya) - 2, 4, 4);
      context.rect(camera.toX(xb) - 2, camera.toY(yb) - 2, 4, 4);
    }
    context.fill();
    if (name !== "refused") continue;
    for (const { xa, ya, xb, yb } of lines.refused) cross(context, camera.toX((xa + xb) / 2), camera.toY((ya + yb) / 2));
  }
  context.globalAlpha = 1;
}

// the last part of a path up to the robot itself, fading backwards
export function recent(context, path, until, head, id, isDim, camera) {
  context.strokeStyle = ofRobot(id);
  context.lineJoin = context.lineCap = "round";
  context.lineWidth = 2.8;
  let k = Math.max(0, path.index(until - RECENT_S));
  const last = path.index(until);
  for (let step = 1; step <= STEPS && k < last; step++) {
    const end = step === STEPS ? last : path.index(until - RECENT_S + (RECENT_S * step) / STEPS);
    if (end <= k) continue;
    context.globalAlpha = (isDim ? 0.2 : 0.95) * (step / STEPS) ** 1.5;
    context.beginPath();
    while (k < end) k = trace(context, path, k, end + 1, camera, (row) => path.state[row] !== BY_ODOMETRY);
    context.stroke();
    k = end;
  }
  if (head && last >= 0 && head.age < 4) {
    context.globalAlpha = isDim ? 0.2 : 0.95;
    context.beginPath();
    context.moveTo(camera.toX(path.x[last]), camera.toY(path.y[last]));
    context.lineTo(camera.toX(head.x), camera.toY(head.y));
    context.stroke();
  }
  context.globalAlpha = 1;
}

// Lines through rows from `k` to before `end`, as long as they are joined and `isAlike`; the row
// that the rest begins with, at least the next one.
function trace(context, path, k, end, camera, isAlike) {
  let px = camera.toX(path.x[k]), py = camera.toY(path.y[k]);
  context.moveTo(px, py);
  const first = k;
  for (k += 1; k < end; k++) {
    if (!path.isJoined(k)) return k;
    if (!isAlike(k)) return Math.max(k - 1, first + 1);
    const x = camera.toX(path.x[k]), y = camera.toY(path.y[k]);
    const way = Math.abs(x - px) + Math.abs(y - py);
    if (way >= APART_PX || k === end - 1) {
      if (way > CURVED_PX) curve(context, path, k, px, py, x, y); else context.lineTo(x, y);
      px = x; py = y;
    }
  }
  return k;
}

// From row k - 1 to row k as a robot drives: it leaves and arrives the way that it looks.
function curve(context, path, k, px, py, x, y) {
  const arm = Math.hypot(x - px, y - py) / 3, from = path.theta[k - 1], to = path.theta[k];
  if (from === null || to === null) { context.lineTo(x, y); return; }
  const along = Math.cos(from) * (x - px) - Math.sin(from) * (y - py) > 0 ? arm : -arm; // or backwards
  if (Math.abs(turn(from, to)) > 2) { context.lineTo(x, y); return; }
  context.bezierCurveTo(px + along * Math.cos(from), py - along * Math.sin(from),
    x - along * Math.cos(to), y + along * Math.sin(to), x, y);
}

function cross(context, x, y) {
  context.lineWidth = 1.8;
  context.beginPath();
  context.moveTo(x - 4, y - 4); context.lineTo(x + 4, y + 4);
  context.moveTo(x - 4, y + 4); context.lineTo(x + 4, y - 4);
  context.stroke();
}

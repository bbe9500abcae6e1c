// The paths and closures: drawn once onto a layer of their own, then only what is new.

import { PAGE, ofRobot } from "./colours.js";
import { BY_ODOMETRY, turn } from "./team.js";

const APART_PX = 2; // points nearer than this are one
const CURVED_PX = 12; // shorter steps are straight
const RECENT_S = 40; // so much of a path is drawn stronger, in steps that fade
const STEPS = 8;
const FRESH_S = 30; // closures are drawn stronger for so long, about

export class PathLayer {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.context = this.canvas.getContext("2d");
    this.key = "";
    this.drawn = new Map(); // by robot: its path's version, and how many rows are drawn
  }

  // the layer, up to date; `until` ends all paths in the past, null shows all
  render(scene, camera, ratio) {
    const { team, ids, until, layers, selected } = scene;
    const key = [camera.x, camera.y, camera.scale, camera.width, camera.height, ratio, until, layers.paths,
      layers.closures, selected, scene.scheme, layers.closures ? team.closuresVersion : 0, ids.join()].join("|");
    if (key !== this.key || this.isReplaced(team, ids)) this.begin(scene, camera, ratio, key);
    if (!layers.paths) return this.canvas;
    for (const id of ids) {
      const { path } = team.robot(id);
      // the newest row still changes: it is drawn by `recent`
      const end = until === null ? path.length - 1 : path.index(until) + 1;
      const from = this.drawn.get(id)?.rows ?? 0;
      if (end > from + (from ? 0 : 1)) {
        this.stroke(path, Math.max(0, from - 1), end, id, selected, camera);
        this.drawn.set(id, { version: path.version, rows: end });
      }
    }
    return this.canvas;
  }

  isReplaced(team, ids) {
    return ids.some((id) => this.drawn.has(id) && this.drawn.get(id).version !== team.robot(id).path.version);
  }

  begin(scene, camera, ratio, key) {
    this.key = key;
    this.drawn.clear();
    const { canvas, context } = this;
    const width = Math.round(camera.width * ratio), height = Math.round(camera.height * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, width, height);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.lineJoin = context.lineCap = "round";
    if (scene.layers.closures) this.closures(scene, camera);
  }

  stroke(path, from, end, id, selected, camera) {
    const { context } = this;
    context.strokeStyle = ofRobot(id);
    const alpha = selected === null || selected === id ? 0.42 : 0.12;
    let k = from;
    while (k < end - 1) {
      const isOdometry = path.state[k + 1] === BY_ODOMETRY;
      context.beginPath();
      context.globalAlpha = isOdometry ? alpha * 0.8 : alpha;
      context.lineWidth = isOdometry ? 1.2 : 1.8;
      context.setLineDash(isOdometry ? [2, 4] : []);
      k = trace(context, path, k, end, camera, (row) => (path.state[row] === BY_ODOMETRY) === isOdometry);
      context.stroke();
    }
    context.globalAlpha = 1;
    context.setLineDash([]);
  }

  closures({ team, ids, until, selected }, camera) {
    const { context } = this, shown = new Set(ids), { now } = team;
    for (const pair of team.pairs.values()) {
      if (!shown.has(pair.a) || !shown.has(pair.b)) continue;
      const isDim = selected !== null && selected !== pair.a && selected !== pair.b;
      for (const closure of pair.closures.values()) {
        if (until !== null && closure.t > until) continue;
        const ends = [camera.toX(closure.xa), camera.toY(closure.ya), camera.toX(closure.xb), camera.toY(closure.yb)];
        const isOld = (until ?? now) - closure.t > FRESH_S;
        context.globalAlpha = (closure.kept ? isOld ? 0.22 : 0.6 : 0.8) * (isDim ? 0.25 : 1);
        context.strokeStyle = context.fillStyle = closure.kept ? PAGE.closure : PAGE.bad;
        context.lineWidth = 1.2;
        context.setLineDash(closure.kept ? [] : [4, 4]);
        context.beginPath();
        context.moveTo(ends[0], ends[1]);
        context.lineTo(ends[2], ends[3]);
        context.stroke();
        context.setLineDash([]);
        context.beginPath();
        context.arc(ends[0], ends[1], 2, 0, 7);
        context.arc(ends[2], ends[3], 2, 0, 7);
        context.fill();
        if (!closure.kept) cross(context, (ends[0] + ends[2]) / 2, (ends[1] + ends[3]) / 2);
      }
    }
    context.globalAlpha = 1;
  }
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

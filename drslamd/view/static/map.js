// One picture of the team: grid, paths, links, ellipses, robots.

import { PAGE, ofRobot, ofScatter } from "./colours.js";
import { PathLayers, closures, recent } from "./paths.js";
import { turn } from "./team.js";

const CHI_95 = Math.sqrt(5.991); // of two degrees of freedom
const EASE_S = 0.16;
const JUMP_M = 3; // farther than any robot drives in an update: it is shown there at once
const BODY_PX = 11;
const GRID_PX = 90;

export class MapView {
  constructor(canvas, camera) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.camera = camera;
    this.paths = new PathLayers();
    this.spots = []; // where robots and links were drawn, for a tap
  }

  // scene: team, ids, t, until (null is live), layers, selected, scheme
  draw(scene, seconds) {
    const { canvas, context, camera } = this;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.round(camera.width * ratio), height = Math.round(camera.height * ratio);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    const here = this.places(scene, seconds);
    const maybe = scene.until === null ? scene.team.possible.filter((p) => p.frame_key === scene.frame) : [];
    const modules = scene.team.modules.filter((m) => m.frame === scene.frame);
    camera.step(this.box(scene, here, [...modules, ...maybe.flatMap(spotsOf)]), seconds);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = PAGE.ground;
    context.fillRect(0, 0, width, height);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.grid();
    this.spots = [];
    if (scene.layers.closures) closures(context, scene, camera);
    if (scene.layers.paths) {
      this.paths.draw(context, scene, camera, ratio, seconds);
      for (const place of here) {
        const isDim = isDimmed(scene, place.id);
        recent(context, scene.team.robot(place.id).path, scene.t, place.row, place.id, isDim, camera);
      }
    }
    if (scene.layers.links) this.links(scene, here);
    if (scene.layers.ellipses) for (const place of here) this.ellipse(scene, place);
    for (const module of modules) this.module(module);
    for (const saying of maybe) this.possible(scene, saying);
    for (const place of here) this.robot(scene, place);
    this.scaleBar();
  }

  // everybody who has a place now, eased towards it while live
  places({ team, ids, t, until }, seconds) {
    const out = [], share = 1 - Math.exp(-seconds / EASE_S);
    for (const id of ids) {
      const robot = team.robot(id), { path } = robot;
      const standing = team.standing(robot, t, until === null);
      const row = path.at(until ?? Infinity);
      if (!row) continue;
      if (until === null) {
        const k = path.length - 1;
        row.age = t - path.t[k];
        const shown = robot.shown;
        if (shown && shown.version === path.version && Math.hypot(row.x - shown.x, row.y - shown.y) < JUMP_M) {
          row.x = shown.x + (row.x - shown.x) * share;
          row.y = shown.y + (row.y - shown.y) * share;
          row.theta = shown.theta + turn(shown.theta, row.theta) * share;
        }
        robot.shown = { x: row.x, y: row.y, theta: row.theta, version: path.version };
      } else robot.shown = null;
      out.push({ id, row, standing });
    }
    return out;
  }

  box({ team, ids }, here, beside) {
    if (!here.length && !beside.length) return null;
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    const take = (x, y) => {
      if (x < box[0]) box[0] = x;
      if (y < box[1]) box[1] = y;
      if (x > box[2]) box[2] = x;
      if (y > box[3]) box[3] = y;
    };
    for (const { row } of here) take(row.x, row.y);
    for (const { x, y } of beside) take(x, y);
    for (const id of ids) {
      const { x, y, length } = team.robot(id).path;
      const stride = 1 + Math.floor(length / 200);
      for (let k = 0; k < length; k += stride) take(x[k], y[k]);
    }
    return box;
  }

  grid() {
    const { context, camera } = this;
    const step = round125(GRID_PX / camera.scale);
    for (const [name, every] of [["grid", 1], ["grid-strong", 5]]) {
      context.strokeStyle = PAGE[name];
      context.lineWidth = 1;
      context.beginPath();
      const first = (from) => Math.ceil(from / step);
      for (let k = first(camera.fromX(0)); k * step <= camera.fromX(camera.width); k++) {
        if (k % every) continue;
        const px = Math.round(camera.toX(k * step)) + 0.5;
        context.moveTo(px, 0); context.lineTo(px, camera.height);
      }
      for (let k = first(camera.fromY(camera.height)); k * step <= camera.fromY(0); k++) {
        if (k % every) continue;
        const py = Math.round(camera.toY(k * step)) + 0.5;
        context.moveTo(0, py); context.lineTo(camera.width, py);
      }
      context.stroke();
    }
  }

  scaleBar() {
    const { context, camera } = this;
    const length = round125(130 / camera.scale), px = length * camera.scale;
    const x = 14, y = camera.height - (camera.width < 760 ? 64 : 18);
    context.strokeStyle = context.fillStyle = PAGE.soft;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x, y - 5); context.lineTo(x, y); context.lineTo(x + px, y); context.lineTo(x + px, y - 5);
    context.stroke();
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "alphabetic";
    context.fillText(length >= 1000 ? `${length / 1000} km` : length >= 1 ? `${length} m` : `${Math.round(length * 100)} cm`, x + 5, y - 6);
  }

  links(scene, here) {
    const { context, camera } = this, { team, t, selected } = scene;
    const place = new Map(here.map((p) => [p.id, p]));
    context.lineCap = "round";
    const drawn = new Set();
    for (const pair of team.pairs.values()) {
      const a = place.get(pair.a), b = place.get(pair.b);
      const scatter = pair.scatter(t);
      if (!a || !b || !scatter || isGone(a) || isGone(b)) continue;
      drawn.add(`${pair.a}-${pair.b}`);
      const isDim = selected !== null && selected !== pair.a && selected !== pair.b;
      this.line(a.row, b.row, ofScatter(scatter[1]), 2.6, isDim ? 0.18 : 0.85);
      this.spots.push({ pair, scatter, ax: camera.toX(a.row.x), ay: camera.toY(a.row.y), bx: camera.toX(b.row.x), by: camera.toY(b.row.y) });
    }
    if (scene.until !== null) return;
    context.setLineDash([3, 5]);
    for (const { id } of here) {
      for (const other of team.robot(id).info?.ranges ?? []) {
        const key = id < other ? `${id}-${other}` : `${other}-${id}`, a = place.get(id), b = place.get(other);
        if (drawn.has(key) || !a || !b || isGone(a) || isGone(b)) continue;
        drawn.add(key);
        this.line(a.row, b.row, PAGE.grey, 1.2, isDimmed(scene, id) && isDimmed(scene, other) ? 0.2 : 0.7);
      }
    }
    context.setLineDash([]);
  }

  line(a, b, colour, width, alpha) {
    const { context, camera } = this;
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.globalAlpha = alpha;
    context.beginPath();
    context.moveTo(camera.toX(a.x), camera.toY(a.y));
    context.lineTo(camera.toX(b.x), camera.toY(b.y));
    context.stroke();
    context.globalAlpha = 1;
  }

  ellipse(scene, { id, row, standing }) {
    const { context, camera } = this;
    const half = (row.xx + row.yy) / 2, spread = Math.hypot((row.xx - row.yy) / 2, row.xy);
    const long = CHI_95 * Math.sqrt(Math.max(0, half + spread)) * camera.scale;
    const short = CHI_95 * Math.sqrt(Math.max(0, half - spread)) * camera.scale;
    if (!(long > 0)) return;
    const angle = Math.atan2(2 * row.xy, row.xx - row.yy) / 2;
    const colour = standing === "doubtful" ? PAGE.warn : isGrey(standing) ? PAGE.grey : ofRobot(id);
    const share = isDimmed(scene, id) ? 0.3 : 1;
    context.beginPath();
    context.ellipse(camera.toX(row.x), camera.toY(row.y), Math.min(long, 1e5), Math.min(short, 1e5), -angle, 0, 7);
    context.fillStyle = context.strokeStyle = colour;
    const isFaint = standing === "possible";
    context.globalAlpha = (isFaint ? 0.06 : 0.13) * share;
    context.fill();
    context.globalAlpha = 0.75 * share;
    context.lineWidth = 1.2;
    context.setLineDash(isFaint || isGrey(standing) ? [4, 4] : []);
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  robot(scene, { id, row, standing }) {
    const { context, camera } = this;
    const x = camera.toX(row.x), y = camera.toY(row.y), colour = isGrey(standing) ? PAGE.grey : ofRobot(id);
    this.spots.push({ id, x, y, standing, colour: colour });
    context.save();
    context.globalAlpha = isDimmed(scene, id) ? 0.35 : 1;
    context.translate(x, y);
    context.rotate(-row.theta);
    this.body(row.hasHeading);
    context.fillStyle = colour;
    context.strokeStyle = PAGE.panel;
    context.lineWidth = 2;
    context.fill();
    context.stroke();
    context.rotate(row.theta);
    if (standing === "doubtful") this.doubt();
    if (scene.selected === id) {
      context.strokeStyle = PAGE.ink;
      context.lineWidth = 2;
      context.beginPath();
      context.arc(0, 0, BODY_PX + 11, 0, 7);
      context.stroke();
    }
    context.fillStyle = PAGE.panel;
    context.font = `700 ${id > 99 ? 9 : 12}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(String(id), 0, 0.5);
    if (standing === "stale" || standing === "lost") this.label(standing === "stale" ? "no odometry" : "lost");
    context.restore();
  }

  // with a nose where it is known which way it looks
  body(hasHeading) {
    const { context } = this, gap = hasHeading ? 0.62 : 0;
    context.beginPath();
    context.arc(0, 0, BODY_PX, gap, 2 * Math.PI - gap);
    if (hasHeading) context.lineTo(BODY_PX * 1.75, 0);
    context.closePath();
  }

  // a module that stands without a robot
  module({ uwb, x, y }) {
    const { context, camera } = this, px = camera.toX(x), py = camera.toY(y);
    context.strokeStyle = PAGE.ink;
    context.fillStyle = PAGE.panel;
    context.lineWidth = 2;
    context.beginPath();
    context.rect(px - 6, py - 6, 12, 12);
    context.fill();
    context.stroke();
    this.spots.push({ module: uwb, x: px, y: py });
    context.font = "600 11px system-ui, sans-serif";
    context.fillStyle = PAGE.soft;
    context.textAlign = "center";
    context.textBaseline = "top";
    context.fillText(`module ${uwb}`, px, py + 10);
  }

  // hollow where a robot may be; hollow too who says so, while nobody is localised
  possible(scene, { origin, frame_key: frame, here: [x, y, theta], places }) {
    const { context } = this;
    for (const [id, share, px, py, turned, xx, xy, yy] of places) {
      const row = { x: px, y: py, theta: turned, xx, xy, yy };
      context.setLineDash([2, 5]);
      this.line({ x, y }, row, ofRobot(id), 1.2, 0.25 + 0.5 * share);
      context.setLineDash([]);
      if (scene.layers.ellipses) this.ellipse(scene, { id, row, standing: "possible" });
      this.hollow(id, row, 0.4 + 0.6 * share);
    }
    if (frame === null) this.hollow(origin, { x, y, theta }, 1);
  }

  hollow(id, row, alpha) {
    const { context, camera } = this, x = camera.toX(row.x), y = camera.toY(row.y);
    this.spots.push({ maybe: id, x, y });
    context.save();
    context.globalAlpha = alpha;
    context.translate(x, y);
    context.rotate(-row.theta);
    this.body(true);
    context.fillStyle = PAGE.ground;
    context.strokeStyle = ofRobot(id);
    context.lineWidth = 2;
    context.fill();
    context.setLineDash([4, 3]);
    context.stroke();
    context.rotate(row.theta);
    context.fillStyle = ofRobot(id);
    context.font = `700 ${id > 99 ? 9 : 12}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(String(id), 0, 0.5);
    context.restore();
  }

  doubt() {
    const { context } = this;
    context.strokeStyle = PAGE.warn;
    context.lineWidth = 2.4;
    context.setLineDash([5, 4]);
    context.beginPath();
    context.arc(0, 0, BODY_PX + 6, 0, 7);
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    context.arc(BODY_PX + 5, -BODY_PX - 5, 8, 0, 7);
    context.fillStyle = PAGE.warn;
    context.fill();
    context.fillStyle = PAGE.panel;
    context.font = "800 12px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText("?", BODY_PX + 5, -BODY_PX - 4.5);
  }

  label(text) {
    const { context } = this;
    context.font = "600 11px system-ui, sans-serif";
    context.fillStyle = PAGE.soft;
    context.textBaseline = "top";
    context.fillText(text, 0, BODY_PX + 6);
  }

  // what is under a finger: a robot, else a link
  under(px, py) {
    const robots = this.spots.filter((s) => s.id !== undefined && Math.hypot(s.x - px, s.y - py) < 24);
    robots.sort((a, b) => Math.hypot(a.x - px, a.y - py) - Math.hypot(b.x - px, b.y - py));
    return robots[0] ?? this.spots.find((s) => s.pair && besides(s, px, py) < 9) ?? null;
  }
}

function spotsOf({ here: [x, y], places }) { return [{ x, y }, ...places.map(([, , px, py]) => ({ x: px, y: py }))]; }
export function isGrey(standing) { return standing === "stale" || standing === "lost" || standing === "away"; }
function isGone({ standing }) { return standing === "lost" || standing === "away"; }
function isDimmed({ selected }, id) { return selected !== null && selected !== id; }

function besides({ ax, ay, bx, by }, px, py) {
  const length = Math.hypot(bx - ax, by - ay) || 1;
  const along = ((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / length;
  const clipped = Math.min(length, Math.max(0, along)) / length;
  return Math.hypot(ax + (bx - ax) * clipped - px, ay + (by - ay) * clipped - py);
}

// the nearest of 1, 2, 5, 10, 20 ... that is not larger
function round125(value) {
  const ten = 10 ** Math.floor(Math.log10(value));
  return ten * (value / ten >= 5 ? 5 : value / ten >= 2 ? 2 : 1);
}

// What is known of the team: paths, pairs, closures, and who is where at any time that is held.

const STANDINGS = ["away", "localised", "doubtful", "stale", "position"];
export const LOCALISED = 1, DOUBTFUL = 2, STALE = 3, BY_ODOMETRY = 9;
export const SILENCE_S = 5;
const GAP_S = 4; // poses farther apart are not joined
const MOST_ROWS = 4000; // of one robot, an hour
const DROPPED = 400;
const MOST_SCATTERS = 1200;
const MOST_CLOSURES = 300;
const LINK_S = 15; // a scatter says something for so long

export class Path {
  constructor() { this.clear(); }

  clear() {
    this.t = []; this.x = []; this.y = []; this.theta = []; this.state = [];
    this.xx = []; this.xy = []; this.yy = [];
    this.version = (this.version ?? 0) + 1; // another one means: draw all of it again
  }

  get length() { return this.t.length; }

  add([t, x, y, theta, state, xx, xy, yy]) {
    let n = this.t.length;
    if (n && t <= this.t[n - 1]) {
      if (t < this.t[n - 1]) return;
      n -= 1; // said again
    }
    // as where the map runs: the last pose gives way when it is not a second from the one before
    else if (n > 1 && this.t[n - 1] - this.t[n - 2] < 0.95) n -= 1;
    this.t[n] = t; this.x[n] = x; this.y[n] = y; this.theta[n] = theta; this.state[n] = state;
    this.xx[n] = xx; this.xy[n] = xy; this.yy[n] = yy;
    if (n >= MOST_ROWS) {
      for (const name of ["t", "x", "y", "theta", "state", "xx", "xy", "yy"]) this[name].splice(0, DROPPED);
      this.version += 1;
    }
  }

  // the last row at or before t, -1 before the first
  index(t) {
    let low = 0, high = this.t.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.t[middle] <= t) low = middle + 1; else high = middle;
    }
    return low - 1;
  }

  at(t) {
    const k = this.index(t);
    if (k < 0) return null;
    const hasHeading = this.theta[k] !== null;
    const row = { x: this.x[k], y: this.y[k], theta: this.theta[k] ?? 0, hasHeading, state: this.state[k],
      xx: this.xx[k], xy: this.xy[k], yy: this.yy[k], age: t - this.t[k] };
    if (k + 1 < this.t.length && this.isJoined(k + 1)) {
      const share = (t - this.t[k]) / (this.t[k + 1] - this.t[k]);
      row.x += (this.x[k + 1] - row.x) * share;
      row.y += (this.y[k + 1] - row.y) * share;
      row.theta += turn(row.theta, this.theta[k + 1] ?? row.theta) * share;
      row.age = 0;
    }
    return row;
  }

  // is row k the end of a way that was driven from row k - 1?
  isJoined(k) { return k > 0 && (this.t[k] - this.t[k - 1] < GAP_S || this.state[k] === BY_ODOMETRY); }
}

export function turn(from, to) {
  const by = (to - from) % (2 * Math.PI);
  return by > Math.PI ? by - 2 * Math.PI : by < -Math.PI ? by + 2 * Math.PI : by;
}

class Robot {
  constructor(id) { this.id = id; this.info = null; this.path = new Path(); this.shown = null; }
}

class Pair {
  constructor(a, b) { this.a = a; this.b = b; this.past = []; this.closures = new Map(); }

  scatter(t) {
    for (let k = this.past.length - 1; k >= 0; k--) {
      if (this.past[k][0] <= t + 0.5) return t - this.past[k][0] < LINK_S ? this.past[k] : null;
    }
    return null;
  }
}

export class Team {
  constructor() { this.reset(); }

  reset() {
    this.robots = new Map(); this.pairs = new Map();
    this.modules = []; this.possible = [];
    this.about = null; this.notShown = 0; this.version = ""; this.isComplete = false;
    this.lead = null; this.heardAt = 0;
  }

  // time where the map runs, carried on since the last update
  get now() { return this.lead === null ? 0 : performance.now() / 1000 + this.lead; }

  get oldest() {
    let oldest = this.now;
    for (const { path } of this.robots.values()) if (path.length) oldest = Math.min(oldest, path.t[0]);
    return oldest;
  }

  robot(id) {
    if (!this.robots.has(id)) this.robots.set(id, new Robot(id));
    return this.robots.get(id);
  }

  pair(a, b) {
    const [low, high] = a < b ? [a, b] : [b, a], key = `${low}-${high}`;
    if (!this.pairs.has(key)) this.pairs.set(key, new Pair(low, high));
    return this.pairs.get(key);
  }

  take(update) {
    this.heardAt = performance.now();
    if (update.hello !== undefined) { this.reset(); this.version = update.hello; }
    if (update.complete) this.isComplete = true;
    if (update.t !== undefined) {
      const lead = update.t - performance.now() / 1000;
      // the smallest delay is the truest; a computer that slept is followed
      if (this.lead === null || lead > this.lead || this.lead - lead > 2) this.lead = lead;
    }
    if (update.team) this.about = update.team;
    for (const key of update.forget ?? []) this.forget(key);
    if (update.robots) this.takeRobots(update.robots, update.not_shown);
    if (update.modules) this.modules = update.modules.map(([uwb, frame, x, y, sigma]) => ({ uwb, frame, x, y, sigma }));
    if (update.possible) this.possible = update.possible;
    for (const [id, rows] of Object.entries(update.paths ?? {})) {
      const { path } = this.robot(+id);
      path.clear();
      for (const row of rows) path.add(row);
    }
    for (const [id, ...row] of update.poses ?? []) this.robot(id).path.add(row);
    for (const [a, b, t, rms, bias] of update.pairs ?? []) this.takeScatter(this.pair(a, b), [t, rms, bias]);
    for (const closure of update.closures ?? []) this.takeClosure(closure);
  }

  takeRobots(infos, notShown) {
    this.notShown = notShown;
    const present = new Set(infos.map((info) => info.id));
    for (const id of this.robots.keys()) if (!present.has(id)) this.robots.delete(id);
    for (const info of infos) this.robot(info.id).info = info;
  }

  forget(key) {
    if (key.length === 1) this.robots.delete(key[0]);
    for (const [name, pair] of this.pairs) {
      if (key.length === 1 && key.some((id) => id === pair.a || id === pair.b)) this.pairs.delete(name);
      else if (key.length === 2 && pair.a === key[0] && pair.b === key[1]) pair.closures.clear();
    }
  }

  takeScatter(pair, row) {
    const { past } = pair, n = past.length;
    if (n && row[0] <= past[n - 1][0]) return;
    if (n > 1 && past[n - 1][0] - past[n - 2][0] < 5) past[n - 1] = row; else past.push(row);
    if (n > MOST_SCATTERS) past.splice(0, n - MOST_SCATTERS + 120);
  }

  takeClosure([a, b, number, t, kept, xa, ya, xb, yb, off]) {
    const { closures } = this.pair(a, b);
    closures.delete(`${a}:${number}`);
    closures.set(`${a}:${number}`, { t, kept, xa, ya, xb, yb, off });
    if (closures.size > MOST_CLOSURES) closures.delete(closures.keys().next().value);
  }

  // what a robot is worth at a time: one of STANDINGS, or "lost"
  standing(robot, t, isLive) {
    if (isLive) {
      const { info } = robot;
      if (!info) return "away";
      if (info.leaving || t - Math.max(info.heard, robot.path.t.at(-1) ?? -1e9) > SILENCE_S) return "lost";
      return STANDINGS[info.state];
    }
    const row = robot.path.at(t);
    if (!row || row.state === BY_ODOMETRY) return "away";
    if (row.age > SILENCE_S) return "lost";
    return STANDINGS[row.state];
  }

  // frames in which robots have a path, that of most of them first
  frames() {
    const found = new Map();
    for (const { info, path } of this.robots.values()) {
      if (!info?.frame_key || !path.length) continue;
      const frame = found.get(info.frame_key) ?? { key: info.frame_key, robot: info.frame, ids: [] };
      frame.ids.push(info.id);
      found.set(info.frame_key, frame);
    }
    return [...found.values()].sort((a, b) => b.ids.length - a.ids.length || a.robot - b.robot);
  }
}

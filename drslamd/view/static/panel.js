// What is said in words: the head, the list of robots, the frames, the clock.

import { WORST_M, ofRobot } from "./colours.js";

const STATES = { localised: "localised", doubtful: "in doubt", stale: "no odometry", position: "position only", lost: "lost", away: "not localised" };
const QUIET_S = 4; // the slowest heartbeat comes every three
const byId = (id) => document.getElementById(id);

export class Panel {
  constructor({ onSelect, onFrame }) {
    this.onSelect = onSelect;
    this.onFrame = onFrame;
    this.rows = new Map();
    byId("worst").textContent = `${WORST_M} m`;
  }

  show(scene, isConnected) {
    this.head(scene.team, isConnected);
    this.frames(scene);
    this.list(scene);
  }

  head(team, isConnected) {
    const { about } = team, robots = [...team.robots.values()];
    const speaking = robots.filter((r) => team.standing(r, team.now, true) !== "lost").length;
    const parts = [`${robots.length} robot${robots.length === 1 ? "" : "s"}`];
    if (speaking < robots.length) parts.push(`${robots.length - speaking} lost`);
    if (team.notShown) parts.push(`${team.notShown} more than can be shown`);
    if (about) parts.push(about.network);
    set(byId("summary"), parts.join("  ·  "));
    const trust = byId("trust");
    trust.hidden = !about;
    if (about) {
      set(trust, about.verified ? "proven" : "not verified");
      trust.title = about.trust;
      trust.className = `badge ${about.verified ? "good" : "warn"}`;
    }
    const problems = [...(about && !about.up ? [about.network] : []), ...(about?.problems ?? [])];
    if (!isConnected) problems.unshift("drslamd view does not answer: what is shown is its last picture");
    byId("problems").hidden = !problems.length;
    set(byId("problems"), problems.join("\n"));
    this.nobody(team, robots, about);
  }

  nobody(team, robots, about) {
    const card = byId("nobody"), isPlaced = team.frames().length > 0;
    card.hidden = isPlaced || !team.isComplete || !about || team.possible.length > 0;
    if (card.hidden) return;
    set(card, robots.length
      ? `${robots.length === 1 ? "One robot is" : `${robots.length} robots are`} heard, nobody is localised yet.\n`
        + "They have to drive some metres of curves within UWB range of each other."
      : `Nobody is heard yet on ${about.network}.\nAre the robots on? Is this the network interface of `
        + "the team (--interface), and do group and port fit?");
  }

  frames({ team, frame }) {
    const frames = team.frames(), place = byId("frames");
    const key = JSON.stringify([frames.map((f) => [f.key, f.ids.length]), frame]);
    if (key === this.framesKey) return;
    this.framesKey = key;
    place.replaceChildren(...(frames.length > 1 ? frames : []).map((f) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = `frame of robot ${f.robot}: ${f.ids.length === 1 ? "1 robot" : `${f.ids.length} robots`}`;
      button.setAttribute("aria-pressed", String(f.key === frame));
      button.onclick = () => this.onFrame(f.key);
      return button;
    }));
  }

  list(scene) {
    const { team } = scene, list = byId("robots");
    const ids = [...team.robots.keys()].sort((a, b) => a - b);
    for (const [id, row] of this.rows) if (!team.robots.has(id)) { row.item.remove(); this.rows.delete(id); }
    ids.forEach((id, place) => {
      if (!this.rows.has(id)) this.rows.set(id, this.row(id));
      const { item } = this.rows.get(id);
      if (list.children[place] !== item) list.insertBefore(item, list.children[place] ?? null);
      this.fill(this.rows.get(id), scene, team.robot(id));
    });
  }

  row(id) {
    const item = document.createElement("li"), button = document.createElement("button");
    button.type = "button";
    const parts = {};
    for (const name of ["disk", "state", "sigma", "facts", "words"]) {
      parts[name] = document.createElement("span");
      parts[name].className = name;
      button.append(parts[name]);
    }
    parts.disk.textContent = String(id);
    parts.sigma.title = "one sigma of its position, in the direction that is known least";
    button.onclick = () => this.onSelect(id);
    item.append(button);
    return { item, button, parts };
  }

  fill({ item, button, parts }, scene, robot) {
    const { team, t, until, selected } = scene, { info, path, id } = robot;
    const isLive = until === null, standing = team.standing(robot, t, isLive);
    if (item.className !== standing) item.className = standing;
    button.setAttribute("aria-pressed", String(selected === id));
    button.style.setProperty("--of", ofRobot(id));
    const isThere = standing !== "away" && path.length > 0;
    set(parts.state, info?.leaving && isLive ? "left" : STATES[standing]);
    set(parts.sigma, isThere ? `± ${length(sigma(path.at(isLive ? Infinity : t)))}` : "");
    set(parts.facts, isLive ? facts(team, robot, t) : "");
    const words = isLive && info ? info.words : [];
    parts.words.hidden = !words.length;
    set(parts.words, words.map((w) => w[0].toUpperCase() + w.slice(1)).join("\n"));
  }

  clock(isLive, behind) {
    set(byId("clock"), isLive ? "now" : `−${minutes(behind)}`);
    byId("live").setAttribute("aria-pressed", String(isLive));
  }

  note(text) {
    byId("note").hidden = !text;
    set(byId("note"), text ?? "");
  }
}

function facts(team, { info, path }, t) {
  if (!info) return "";
  const heard = Math.max(info.heard, path.t.at(-1) ?? -Infinity);
  const age = t - heard;
  if (age > QUIET_S) return `silent for ${minutes(age)}`;
  return `hears ${info.hears.length} · ranges to ${info.ranges.length}`;
}

function sigma(row) {
  if (!row) return 0;
  const half = (row.xx + row.yy) / 2;
  return Math.sqrt(Math.max(0, half + Math.hypot((row.xx - row.yy) / 2, row.xy)));
}

export function length(m) {
  if (m < 0.995) return `${(100 * m).toFixed(m < 0.0995 ? 1 : 0)} cm`;
  return m < 9.95 ? `${m.toFixed(1)} m` : m < 9999 ? `${m.toFixed(0)} m` : "far";
}

function minutes(seconds) {
  const whole = Math.max(0, Math.round(seconds)), m = Math.floor(whole / 60), s = String(whole % 60).padStart(2, "0");
  return m < 60 ? `${m}:${s}` : `${Math.floor(m / 60)}:${String(m % 60).padStart(2, "0")}:${s}`;
}

function set(element, text) { if (element.textContent !== text) element.textContent = text; }

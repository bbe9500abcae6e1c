// Colours of robots and links; those of the page come from the style sheet, light or dark.

const HUES = [255, 45, 162, 345, 210, 95, 305, 25, 130, 280];
const GOLDEN_ANGLE = 137.5;

export const WORST_M = 0.5; // ranges that scatter by so much or more are red
const SCALE = [[24, 164, 124], [226, 163, 43], [216, 52, 43]];

export const PAGE = {};
const ofRobots = new Map();

export function readPage() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ground", "panel", "ink", "soft", "grid", "grid-strong", "grey", "warn",
    "bad", "accent", "closure", "light", "chroma"]) {
    PAGE[name] = style.getPropertyValue(`--${name}`).trim();
  }
  ofRobots.clear();
}

export function ofRobot(id) {
  if (!ofRobots.has(id)) {
    const hue = id < HUES.length ? HUES[id] : (HUES[id % HUES.length] + GOLDEN_ANGLE * id) % 360;
    ofRobots.set(id, `oklch(${PAGE.light} ${PAGE.chroma} ${hue.toFixed(0)})`);
  }
  return ofRobots.get(id);
}

export function ofScatter(rms) {
  const share = Math.min(1, rms / WORST_M) * (SCALE.length - 1);
  const k = Math.min(SCALE.length - 2, Math.floor(share));
  const mixed = SCALE[k].map((v, i) => Math.round(v + (SCALE[k + 1][i] - v) * (share - k)));
  return `rgb(${mixed.join(" ")})`;
}

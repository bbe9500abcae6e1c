// The live map: a stream of updates in, sixty pictures a second out.

import { Camera } from "./camera.js";
import { readPage } from "./colours.js";
import { MapView } from "./map.js";
import { Panel, length } from "./panel.js";
import { Team } from "./team.js";

const RETRY_MS = 2000;
const QUIET_MS = 4000; // the map says something every second
const WORDS_MS = 250;
const KEPT_FRAMES = 600;

const byId = (id) => document.getElementById(id);
const team = new Team();
const canvas = byId("map"), slider = byId("slider");
const camera = new Camera(canvas);
const map = new MapView(canvas, camera);
const dark = matchMedia("(prefers-color-scheme: dark)");
const layers = { paths: true, ellipses: true, links: true, closures: true };
let selected = null, chosenFrame = null, until = null, scheme = 0, spotted = null;
let source = null, isConnected = true, lastFrame = 0, lastWords = 0;

// For tests and the curious: how long pictures took, and how far apart they were, ms.
export const pace = { drawn: [], apart: [] };
window.liveMap = { team, camera, map, pace, scene };

const panel = new Panel({
  onSelect: (id) => { selected = selected === id ? null : id; spotted = null; },
  onFrame: (key) => { chosenFrame = key; camera.follow(); },
});

function connect() {
  source?.close();
  source = new EventSource("stream");
  source.onmessage = (event) => team.take(JSON.parse(event.data));
  source.onerror = () => { if (source.readyState === EventSource.CLOSED) setTimeout(connect, RETRY_MS); };
}

function scene() {
  const frames = team.frames();
  const frame = frames.find((f) => f.key === chosenFrame) ?? frames[0] ?? null;
  if (selected !== null && !team.robots.has(selected)) selected = null;
  return { team, layers, selected, scheme, until, t: until ?? team.now, frame: frame?.key ?? null,
    ids: (frame?.ids ?? []).slice().sort((a, b) => a - b) };
}

function frame(at) {
  requestAnimationFrame(frame);
  const seconds = Math.min(0.25, (at - lastFrame) / 1000), began = performance.now();
  keep(pace.apart, at - lastFrame);
  lastFrame = at;
  const now = scene();
  map.draw(now, seconds);
  if (at - lastWords > WORDS_MS) { lastWords = at; words(now); }
  keep(pace.drawn, performance.now() - began);
}

function keep(list, value) { list.push(value); if (list.length > KEPT_FRAMES) list.splice(0, KEPT_FRAMES / 2); }

function words(now) {
  isConnected = !team.heardAt || performance.now() - team.heardAt < QUIET_MS;
  slider.min = team.oldest.toFixed(1);
  slider.max = team.now.toFixed(1);
  if (until === null) slider.value = slider.max;
  else if (until < +slider.min) until = +slider.min;
  panel.clock(until === null, team.now - (until ?? 0));
  panel.show(now, isConnected);
  panel.note(spotted && note(spotted, now));
}

function note(pair, { t }) {
  const scatter = pair.scatter(t), kept = [...pair.closures.values()].filter((c) => c.kept);
  const refused = pair.closures.size - kept.length;
  return `Robots ${pair.a} and ${pair.b}: `
    + (scatter ? `ranges off by ${length(scatter[1])}, their bias taken out (${(100 * scatter[2]).toFixed(0)} cm)` : "no ranges of late")
    + `\n${kept.length} closures heard, ${refused} refused again`;
}

slider.addEventListener("input", () => {
  const isEnd = +slider.value >= +slider.max - 0.5;
  until = isEnd ? null : +slider.value;
  words(scene());
});
byId("live").onclick = () => { until = null; };
byId("fit").onclick = () => camera.follow();
for (const box of document.querySelectorAll("[data-layer]")) {
  box.onchange = () => { layers[box.dataset.layer] = box.checked; };
}
document.addEventListener("keydown", (event) => {
  if (event.key === "f" || event.key === "F") camera.follow();
  if (event.key === "Escape") { selected = spotted = null; until = null; }
});
camera.onTap = (x, y) => {
  const spot = map.under(x, y);
  spotted = spot?.pair ?? null;
  selected = spot && spot.id !== undefined && spot.id !== selected ? spot.id : null;
};
dark.addEventListener("change", () => { readPage(); scheme += 1; });

readPage();
connect();
requestAnimationFrame((at) => { lastFrame = at; frame(at); });

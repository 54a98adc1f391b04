// The map, in metres, north up. It is told where things are by the store and draws them.

import { attribute, fit, h, text, theme } from "./dom.js";
import { changed, isSourceStale, store } from "./store.js";
import { number } from "./words.js";
import { short, TONES } from "./permissions.js";

const ZOOM = { least: 0.02, most: 40, step: 1.3 };
const NICE = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000];

/** What is in the middle, and pixels a metre. */
const view = { north: 0, east: 0, scale: 1, follow: false, fitted: null };
let canvas;
let picking = null;
let hover = null;
let readout;

export function mountMap() {
  const panel = document.getElementById("map");
  canvas = h("canvas", { tabindex: "0", role: "application", "aria-label": "Map. Arrow keys pan, plus and minus zoom, F follows, 0 shows all." });
  const follow = h("button", { "aria-pressed": "false", id: "map-follow", title: "Keep the vehicle in the middle (F)", click: () => setFollow(!view.follow) }, "Follow");
  const tools = h("div", { class: "map-tools" },
    h("button", { "aria-label": "Zoom in", title: "Zoom in (+)", click: () => zoom(ZOOM.step) }, "+"),
    h("button", { "aria-label": "Zoom out", title: "Zoom out (−)", click: () => zoom(1 / ZOOM.step) }, "−"),
    h("button", { title: "Show everything (0)", id: "map-all", click: showAll }, "All"),
    follow,
  );
  readout = h("div", { class: "map-readout figure" });
  panel.append(canvas, tools, readout, legend());
  setFollow = (on) => {
    view.follow = on;
    attribute(follow, "aria-pressed", String(on));
    changed();
  };
  listen();
  return () => draw();
}

let setFollow = () => {};

function legend() {
  const item = (kind, words) => h("span", { class: `key ${kind}` }, words);
  return h("div", { class: "map-legend", "aria-hidden": "true" },
    item("none", "not asked"), item("warn", "asked"), item("good", "granted"), item("bad", "denied, revoked"), item("keep", "keep out"));
}

/** Lets the operator choose a place; `null` when that is cancelled. */
export function pickPlace() {
  return new Promise((resolve) => {
    const { northM = 0, eastM = 0 } = vehicle()?.position ?? {};
    picking = { north: northM, east: eastM, resolve };
    document.getElementById("map").classList.add("picking");
    canvas.focus();
    changed();
  });
}

/** Ends choosing a place, with none. */
export function stopPicking() {
  finishPicking(null);
}

function finishPicking(place) {
  if (!picking) return;
  const { resolve } = picking;
  picking = null;
  document.getElementById("map").classList.remove("picking");
  resolve(place);
  changed();
}

function vehicle() {
  return store.doc?.aircraft?.localPosition;
}

const toScreen = (north, east) => [
  canvas.clientWidth / 2 + (east - view.east) * view.scale,
  canvas.clientHeight / 2 - (north - view.north) * view.scale,
];

const toGround = (x, y) => ({
  north: view.north - (y - canvas.clientHeight / 2) / view.scale,
  east: view.east + (x - canvas.clientWidth / 2) / view.scale,
});

function zoom(factor, x = canvas.clientWidth / 2, y = canvas.clientHeight / 2) {
  const before = toGround(x, y);
  view.scale = Math.min(ZOOM.most, Math.max(ZOOM.least, view.scale * factor));
  const after = toGround(x, y);
  view.north += before.north - after.north;
  view.east += before.east - after.east;
  changed();
}

function pan(x, y) {
  if (view.follow) setFollow(false);
  view.east -= x / view.scale;
  view.north += y / view.scale;
  changed();
}

/** Areas, sites and the vehicle, with a border. */
function showAll() {
  setFollow(false);
  const points = [{ northM: 0, eastM: 0 }, vehicle()?.position, ...(store.doc?.areas ?? []).flatMap((it) => it.corners), ...(store.doc?.mission?.objectives ?? []).map((it) => it.position)].filter(Boolean);
  const [north, east] = [points.map((it) => it.northM ?? 0), points.map((it) => it.eastM ?? 0)];
  const [high, low, right, left] = [Math.max(...north), Math.min(...north), Math.max(...east), Math.min(...east)];
  view.north = (high + low) / 2;
  view.east = (right + left) / 2;
  view.scale = Math.min((canvas.clientWidth - 90) / Math.max(right - left, 40), (canvas.clientHeight - 110) / Math.max(high - low, 40));
  changed();
}

function listen() {
  const fingers = new Map();
  let moved = false;
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(event.deltaY < 0 ? ZOOM.step : 1 / ZOOM.step, event.offsetX, event.offsetY);
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
    moved = false;
  });
  canvas.addEventListener("pointermove", (event) => {
    const now = [event.offsetX, event.offsetY];
    hover = toGround(...now);
    const before = fingers.get(event.pointerId);
    if (before) {
      moved ||= Math.hypot(now[0] - before[0], now[1] - before[1]) > 2;
      const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
      if (other) zoom(Math.hypot(now[0] - other[0], now[1] - other[1]) / Math.max(1, Math.hypot(before[0] - other[0], before[1] - other[1])), ...other);
      else if (moved) pan(now[0] - before[0], now[1] - before[1]);
      if (moved) fingers.set(event.pointerId, now);
    }
    changed();
  });
  canvas.addEventListener("pointerup", (event) => {
    fingers.delete(event.pointerId);
    if (picking && !moved) finishPicking(toGround(event.offsetX, event.offsetY));
  });
  canvas.addEventListener("pointercancel", (event) => fingers.delete(event.pointerId));
  canvas.addEventListener("pointerleave", () => (hover = null));
  canvas.addEventListener("keydown", onKey);
}

function onKey(event) {
  const arrows = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] };
  const arrow = arrows[event.key];
  if (arrow && picking) {
    const metres = (event.shiftKey ? 50 : 10) / view.scale;
    picking.east += arrow[0] * metres;
    picking.north += arrow[1] * metres;
    changed();
  } else if (arrow) pan(-arrow[0] * 60, arrow[1] * 60);
  else if (event.key === "Enter" && picking) finishPicking({ north: picking.north, east: picking.east });
  else if (event.key === "+" || event.key === "=") zoom(ZOOM.step);
  else if (event.key === "-") zoom(1 / ZOOM.step);
  else if (event.key === "0") showAll();
  else if (event.key === "f" || event.key === "F") setFollow(!view.follow);
  else return;
  event.preventDefault();
}

function draw() {
  if (store.doc && view.fitted !== store.selected && store.doc.areas) {
    view.fitted = store.selected;
    showAll();
  }
  const here = vehicle();
  if (view.follow && here?.position) Object.assign(view, { north: here.position.northM ?? 0, east: here.position.eastM ?? 0 });
  const { context, width, height } = fit(canvas);
  const pen = { context, width, height, colour: theme(), font: getComputedStyle(canvas).fontFamily };
  grid(pen);
  if (store.doc) {
    store.doc.areas?.forEach((it) => area(pen, it));
    route(pen);
    sites(pen);
    store.doc.traffic?.forEach((it) => traffic(pen, it));
    if (here?.position) aircraft(pen, here);
    wind(pen, store.doc.wind ?? store.doc.aircraft?.wind);
  }
  if (picking) mark(pen, picking);
  scaleBar(pen);
  text(readout, hover ? `N ${number(hover.north)}  E ${number(hover.east)}` : "");
}

function line(context, points) {
  context.beginPath();
  points.forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)));
}

function label({ context, colour, font }, words, x, y, tone = "ink", weight = 600) {
  context.font = `${weight} 12px ${font}`;
  context.lineJoin = "round";
  context.lineWidth = 3;
  context.strokeStyle = colour("map");
  context.strokeText(words, x, y);
  context.fillStyle = colour(tone);
  context.fillText(words, x, y);
}

/** The nicest distance that is at least this many pixels long. */
function nice(pixels) {
  return NICE.find((it) => it * view.scale >= pixels) ?? NICE.at(-1);
}

function grid({ context, width, height, colour }) {
  const step = nice(60);
  const [low, high] = [toGround(0, height), toGround(width, 0)];
  context.lineWidth = 1;
  const draw = (from, to, at) => {
    for (let n = Math.ceil(from / step); n * step <= to; n++) {
      context.strokeStyle = colour(n === 0 ? "axis" : "grid");
      line(context, at(n * step));
      context.stroke();
    }
  };
  const crisp = (it) => Math.round(it) + 0.5;
  draw(low.east, high.east, (e) => [[crisp(toScreen(0, e)[0]), 0], [crisp(toScreen(0, e)[0]), height]]);
  draw(low.north, high.north, (n) => [[0, crisp(toScreen(n, 0)[1])], [width, crisp(toScreen(n, 0)[1])]]);
}

function area(pen, it) {
  const { context, colour } = pen;
  const keepOut = it.kind === "AREA_KIND_KEEP_OUT";
  const held = store.doc.permissions?.find((p) => p.area === it.name);
  const state = short(held?.state);
  const tone = keepOut ? "bad" : (TONES[state] ?? "muted");
  const corners = it.corners.map((c) => toScreen(c.northM ?? 0, c.eastM ?? 0));
  line(context, corners);
  context.closePath();
  context.fillStyle = colour(tone);
  context.globalAlpha = state === "GRANTED" || state === "REQUESTED" ? 0.16 : 0.09;
  context.fill();
  if (keepOut || tone === "bad" || tone === "warn") hatch(pen, corners, tone, keepOut);
  context.globalAlpha = 1;
  line(context, corners);
  context.closePath();
  context.strokeStyle = colour(tone);
  context.lineWidth = keepOut ? 2.5 : 1.5;
  context.setLineDash(TONES[state] || keepOut ? [] : [6, 4]);
  context.stroke();
  context.setLineDash([]);
  const x = Math.min(...corners.map((c) => c[0])) + 8;
  const y = Math.min(...corners.map((c) => c[1])) + 18;
  label(pen, it.name, x, y, "ink", 700);
  const words = keepOut ? "keep out" : { REQUESTED: "asked, undecided", "": "not asked", UNSPECIFIED: "not asked" }[state] ?? state.toLowerCase();
  label(pen, words + band(it), x, y + 15, tone === "muted" ? "muted" : tone, 500);
}

function band({ floorM, ceilingM }) {
  if (floorM == null && ceilingM == null) return "";
  return `, ${floorM == null ? "ground" : `${number(floorM)} m`} to ${ceilingM == null ? "any height" : `${number(ceilingM)} m`}`;
}

/** Stripes, since colour alone is not for everybody, nor for bright sun. */
function hatch({ context, colour }, corners, tone, crossed) {
  context.save();
  line(context, corners);
  context.closePath();
  context.clip();
  context.globalAlpha = 0.35;
  context.strokeStyle = colour(tone);
  context.lineWidth = 1;
  const [xs, ys] = [corners.map((c) => c[0]), corners.map((c) => c[1])];
  const [left, right, top, bottom] = [Math.max(Math.min(...xs), -100), Math.min(Math.max(...xs), 6000), Math.max(Math.min(...ys), -100), Math.min(Math.max(...ys), 6000)];
  for (let x = left - (bottom - top); x < right; x += 11) {
    line(context, [[x, bottom], [x + bottom - top, top]]);
    context.stroke();
    if (crossed) {
      line(context, [[x, top], [x + bottom - top, bottom]]);
      context.stroke();
    }
  }
  context.restore();
}

function route(pen) {
  const { context, colour } = pen;
  context.lineJoin = "round";
  if (store.trail.length > 1) {
    line(context, store.trail.map((it) => toScreen(it.north, it.east)));
    context.strokeStyle = colour("done");
    context.lineWidth = 3;
    context.stroke();
  }
  const here = vehicle()?.position;
  const ahead = store.plan.steps.filter((it) => !store.plan.done.has(it.step.id));
  if (!here || !ahead.length || store.doc.report) return;
  const goal = (it) => toScreen(it.step.goalState?.position?.northM ?? 0, it.step.goalState?.position?.eastM ?? 0);
  let from = toScreen(here.northM ?? 0, here.eastM ?? 0);
  const current = store.doc.plan?.current;
  for (const it of ahead) {
    const to = goal(it);
    const present = it.step.id === current?.stepId;
    context.strokeStyle = colour("accent");
    context.lineWidth = present ? 3 : 1.5;
    context.setLineDash(present ? (current.inTransition ? [3, 5] : []) : [8, 6]);
    line(context, [from, to]);
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    context.arc(...to, present ? 5 : 3.5, 0, 2 * Math.PI);
    context.fillStyle = present ? colour("accent") : colour("map");
    context.fill();
    context.lineWidth = 1.5;
    context.stroke();
    from = to;
  }
  if (current?.inTransition) label(pen, "transition", ...toScreen((here.northM ?? 0) - 26 / view.scale, (here.eastM ?? 0) + 14 / view.scale), "warn");
}

function sites(pen) {
  const { context, colour } = pen;
  const [homeX, homeY] = toScreen(0, 0);
  context.strokeStyle = colour("ink");
  context.lineWidth = 2;
  line(context, [[homeX - 7, homeY + 1], [homeX, homeY - 7], [homeX + 7, homeY + 1]]);
  context.stroke();
  context.strokeRect(homeX - 4.5, homeY, 9, 7);
  const under = new Map();
  store.doc.mission?.objectives?.forEach((it, index) => {
    const [x, y] = toScreen(it.position?.northM ?? 0, it.position?.eastM ?? 0);
    const tone = { OBJECTIVE_STATE_SUCCESS: "good", OBJECTIVE_STATE_FAILURE: "bad" }[it.state] ?? (index === store.doc.mission.currentObjective ? "accent" : "muted");
    const place = `${Math.round(x)},${Math.round(y)}`;
    const row = under.get(place) ?? 0;
    under.set(place, row + 1);
    if (Math.hypot(x - homeX, y - homeY) > 12) {
      context.strokeStyle = colour(tone);
      context.lineWidth = 2;
      context.strokeRect(x - 7, y - 7, 14, 14);
    }
    const glyph = { good: " ✓", bad: " ✕" }[tone] ?? "";
    label(pen, `${index + 1} ${it.name}${glyph}`, x + 12, y + 22 + row * 15, tone);
  });
}

/** An arrow head that points where the nose does; hollow when its data are old. */
function aircraft(pen, { position, headingRad = 0, velocity }) {
  const { context, colour } = pen;
  const [x, y] = toScreen(position.northM ?? 0, position.eastM ?? 0);
  const old = isSourceStale("introspection");
  const { northMS = 0, eastMS = 0 } = velocity ?? {};
  if (!old && Math.hypot(northMS, eastMS) > 0.5) {
    context.strokeStyle = colour("ink");
    context.lineWidth = 1.5;
    line(context, [[x, y], [x + eastMS * 4, y - northMS * 4]]);
    context.stroke();
  }
  context.save();
  context.translate(x, y);
  context.rotate(headingRad);
  line(context, [[0, -13], [9, 10], [0, 5], [-9, 10]]);
  context.closePath();
  context.fillStyle = old ? colour("map") : colour("vehicle");
  context.strokeStyle = old ? colour("bad") : colour("map");
  context.lineWidth = 2;
  if (old) context.setLineDash([3, 2]);
  context.fill();
  context.stroke();
  context.restore();
  const height = store.doc.aircraft?.derived?.heightM;
  label(pen, `${store.selected}  ${number(height)} m${old ? "  old" : ""}`, x + 14, y - 10, old ? "bad" : "ink");
}

function traffic(pen, it) {
  if (!it.position) return;
  const { context, colour } = pen;
  const [x, y] = toScreen(it.position.northM ?? 0, it.position.eastM ?? 0);
  line(context, [[x, y - 7], [x + 7, y], [x, y + 7], [x - 7, y]]);
  context.closePath();
  context.strokeStyle = colour("warn");
  context.lineWidth = 2;
  context.stroke();
  const { northMS = 0, eastMS = 0 } = it.velocity ?? {};
  line(context, [[x, y], [x + eastMS * 4, y - northMS * 4]]);
  context.stroke();
  label(pen, `${it.id ?? "traffic"}  ${number(-(it.position.downM ?? 0))} m`, x + 10, y - 6, "warn");
}

/** Points where the wind blows to. */
function wind(pen, it) {
  if (!it) return;
  const { context, colour, width } = pen;
  const speed = Math.hypot(it.northMS ?? 0, it.eastMS ?? 0);
  context.save();
  context.translate(width - 40, 40);
  context.rotate(Math.atan2(it.eastMS ?? 0, it.northMS ?? 0));
  context.strokeStyle = colour("ink");
  context.lineWidth = 2;
  line(context, [[0, 16], [0, -16], [-5, -9], [0, -16], [5, -9]]);
  context.stroke();
  context.restore();
  label(pen, `wind ${number(speed, 1)} m/s`, width - 84, 76);
}

function mark(pen, { north, east }) {
  const { context, colour } = pen;
  const [x, y] = toScreen(north, east);
  context.strokeStyle = colour("bad");
  context.lineWidth = 2;
  line(context, [[x - 14, y], [x + 14, y]]);
  context.stroke();
  line(context, [[x, y - 14], [x, y + 14]]);
  context.stroke();
  context.beginPath();
  context.arc(x, y, 9, 0, 2 * Math.PI);
  context.stroke();
}

function scaleBar(pen) {
  const { context, colour, height } = pen;
  const metres = nice(60);
  const length = metres * view.scale;
  const [x, y] = [14, height - 14];
  context.strokeStyle = colour("ink");
  context.lineWidth = 2;
  line(context, [[x, y - 5], [x, y], [x + length, y], [x + length, y - 5]]);
  context.stroke();
  label(pen, metres >= 1000 ? `${metres / 1000} km` : `${metres} m`, x + 6, y - 7, "ink", 500);
}

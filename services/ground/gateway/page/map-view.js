// The view of the map: its centre and scale, and conversion between metres and pixels.

import { changed, store } from "./store.js";
import { fleetPositions } from "./map-fleet.js";

const ZOOM = { least: 0.02, most: 40 };
/** One press of a key or turn of a wheel. */
export const STEP = 1.3;
const NICE = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000];

/** The centre in metres, and pixels per metre. */
const view = { north: 0, east: 0, scale: 1, follow: false, fitted: null };
let canvas = null;
let followChanged = () => {};

/** Shows the view on a canvas; `onFollow` is called when following the vehicle starts or stops. */
export function openView(element, onFollow) {
  canvas = element;
  followChanged = onFollow;
}

/** The vehicle's position, if it is known. */
export function vehicle() {
  return store.doc?.aircraft?.localPosition;
}

/** A position in pixels. */
export function place(position) {
  return toScreen(position?.northM ?? 0, position?.eastM ?? 0);
}

export function toScreen(north, east) {
  return [canvas.clientWidth / 2 + (east - view.east) * view.scale, canvas.clientHeight / 2 - (north - view.north) * view.scale];
}

export function toGround(x, y) {
  return {
    north: view.north - (y - canvas.clientHeight / 2) / view.scale,
    east: view.east + (x - canvas.clientWidth / 2) / view.scale,
  };
}

export function metres(pixels) {
  return pixels / view.scale;
}

export function pixels(metres) {
  return metres * view.scale;
}

/** The smallest round distance that is at least this many pixels long. */
export function nice(atLeast) {
  return NICE.find((it) => it * view.scale >= atLeast) ?? NICE.at(-1);
}

export function zoom(factor, x = canvas.clientWidth / 2, y = canvas.clientHeight / 2) {
  const before = toGround(x, y);
  view.scale = Math.min(ZOOM.most, Math.max(ZOOM.least, view.scale * factor));
  const after = toGround(x, y);
  view.north += before.north - after.north;
  view.east += before.east - after.east;
  changed();
}

export function pan(x, y) {
  if (view.follow) follow(false);
  view.east -= x / view.scale;
  view.north += y / view.scale;
  changed();
}

/** Keeps the vehicle in the centre, or stops doing so. */
export function follow(on = !view.follow) {
  view.follow = on;
  followChanged(on);
  changed();
}

/** The corners of an area that are to be seen: what is round a hole may end far away. */
const seenOf = ({ corners, holes = [] }) => (holes.length ? holes.flatMap((it) => it.corners) : corners);

/** Fits areas, sites, the mission that is tried out and the vehicle into the view. */
export function showAll() {
  follow(false);
  const doc = store.doc;
  const tried = (store.whatIf ?? []).flatMap((it) => it.plan?.steps ?? []).map((it) => it.goalState?.position);
  const points = [{}, vehicle()?.position, ...(doc?.areas ?? []).flatMap(seenOf), ...(doc?.mission?.objectives ?? []).map((it) => it.position), ...(doc?.sites ?? []).map((it) => it.position), ...fleetPositions(), ...tried].filter(Boolean);
  const [north, east] = [points.map((it) => it.northM ?? 0), points.map((it) => it.eastM ?? 0)];
  const [high, low, right, left] = [Math.max(...north), Math.min(...north), Math.max(...east), Math.min(...east)];
  view.north = (high + low) / 2;
  view.east = (right + left) / 2;
  view.scale = Math.min((canvas.clientWidth - 90) / Math.max(right - left, 40), (canvas.clientHeight - 110) / Math.max(high - low, 40));
  changed();
}

/** Before each drawing: fits a mission seen for the first time, or after the screen was turned, and centres a vehicle that is followed. */
export function settleView() {
  const mission = store.doc?.mission;
  const turned = innerWidth > innerHeight ? "wide" : "high";
  const seen = mission?.objectives?.length ? `${store.selected}/${mission.name}/${turned}` : null;
  if (seen && view.fitted !== seen) {
    view.fitted = seen;
    showAll();
  }
  const position = vehicle()?.position;
  if (view.follow && position) Object.assign(view, { north: position.northM ?? 0, east: position.eastM ?? 0 });
}

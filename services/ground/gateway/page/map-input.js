// Pointers, wheel and keys on the map; and choosing a place on it.

import { changed, store } from "./store.js";
import { selectAt } from "./map-fleet.js";
import { placeAt } from "./map-draft.js";
import { STEP, follow, metres, pan, showAll, toGround, vehicle, zoom } from "./map-view.js";

let canvas = null;
/** The place that the operator is choosing, and the function that completes the choice. */
let picking = null;
/** The place that was chosen, while the second step asks for confirmation. */
let chosen = null;
let hover = null;
/** The place of the mission's text that is being dragged, by its number. */
let dragged = null;

/** The mark of the chosen place, and the place under the pointer. */
export const pointed = { mark: () => picking ?? chosen, hover: () => hover };

/** Lets the operator choose a place; `null` when the operator cancels. */
export function pickPlace() {
  finish(null);
  return new Promise((resolve) => {
    const { northM = 0, eastM = 0 } = vehicle()?.position ?? {};
    picking = { north: northM, east: eastM, resolve };
    document.getElementById("map").classList.add("picking");
    canvas.focus();
    changed();
  });
}

/** Marks a place until `stopPicking`. */
export function markPlace(place) {
  chosen = place;
  changed();
}

/** Cancels choosing a place, and removes its mark. */
export function stopPicking() {
  chosen = null;
  finish(null);
}

function finish(place) {
  if (!picking) return;
  const { resolve } = picking;
  picking = null;
  document.getElementById("map").classList.remove("picking");
  resolve(place);
  changed();
}

/** Listens to input on the map. */
export function listen(element) {
  canvas = element;
  const fingers = new Map();
  let moved = false;
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(event.deltaY < 0 ? STEP : 1 / STEP, event.offsetX, event.offsetY);
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
    moved = false;
    dragged = fingers.size === 1 && !picking ? placeAt(event.offsetX, event.offsetY) : null;
  });
  canvas.addEventListener("pointermove", (event) => {
    const now = [event.offsetX, event.offsetY];
    hover = toGround(...now);
    const before = fingers.get(event.pointerId);
    if (before) {
      moved ||= Math.hypot(now[0] - before[0], now[1] - before[1]) > 2;
      const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
      if (other) pinch(before, now, other);
      else if (dragged != null) store.draft.move(dragged, hover);
      else if (moved) pan(now[0] - before[0], now[1] - before[1]);
      if (moved) fingers.set(event.pointerId, now);
    }
    changed();
  });
  canvas.addEventListener("pointerup", (event) => {
    fingers.delete(event.pointerId);
    const wasDragged = dragged != null;
    dragged = null;
    if (moved || wasDragged) return;
    if (picking) finish(toGround(event.offsetX, event.offsetY));
    else selectAt(event.offsetX, event.offsetY);
  });
  canvas.addEventListener("pointercancel", (event) => {
    fingers.delete(event.pointerId);
    dragged = null;
  });
  canvas.addEventListener("pointerleave", () => (hover = null));
  canvas.addEventListener("keydown", onKey);
}

/** Two fingers: the map is scaled about the one that rests. */
function pinch(before, now, rests) {
  const distance = (it) => Math.hypot(it[0] - rests[0], it[1] - rests[1]);
  zoom(distance(now) / Math.max(1, distance(before)), ...rests);
}

function onKey(event) {
  const arrow = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] }[event.key];
  if (arrow && picking) {
    const step = metres(event.shiftKey ? 50 : 10);
    picking.east += arrow[0] * step;
    picking.north += arrow[1] * step;
    changed();
  } else if (arrow) pan(-arrow[0] * 60, arrow[1] * 60);
  else if (event.key === "Enter" && picking) finish({ north: picking.north, east: picking.east });
  else if (event.key === "+" || event.key === "=") zoom(STEP);
  else if (event.key === "-") zoom(1 / STEP);
  else if (event.key === "0") showAll();
  else if (event.key === "f" || event.key === "F") follow();
  else return;
  event.preventDefault();
}

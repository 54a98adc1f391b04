// The places of a mission's text that is being edited, as handles on the map.

import { store } from "./store.js";
import { toScreen } from "./map-view.js";

/** How far from its middle a handle is taken hold of, in pixels: a finger is coarser than a pointer. */
const REACH = 16;

/** Squares for corners, circles for objectives and sites. */
export function draft({ context, colour }) {
  for (const { north, east, isCorner } of store.draft.places) {
    const [x, y] = toScreen(north, east);
    context.beginPath();
    if (isCorner) context.rect(x - 6, y - 6, 12, 12);
    else context.arc(x, y, 7, 0, 2 * Math.PI);
    context.fillStyle = colour("map");
    context.fill();
    context.lineWidth = 2;
    context.strokeStyle = colour("ink");
    context.stroke();
  }
}

/** The number of the handle at these pixels: the nearest one; `null` if there is none. */
export function placeAt(x, y) {
  const away = store.draft.places.map(({ north, east }) => {
    const [left, top] = toScreen(north, east);
    return Math.hypot(left - x, top - y);
  });
  const nearest = Math.min(...away);
  return nearest < REACH ? away.indexOf(nearest) : null;
}

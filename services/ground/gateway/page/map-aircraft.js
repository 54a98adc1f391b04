// Aircraft: the vehicle, and other traffic.

import { isSourceStale, store } from "./store.js";
import { place } from "./map-view.js";
import { heading, label, line } from "./map-pen.js";
import { number } from "./words.js";

/** An arrow head that points where the nose points; hollow when its data are stale. */
export function aircraft(pen, { position, headingRad = 0, velocity = {} }) {
  const { context, colour } = pen;
  const [x, y] = place(position);
  const stale = isSourceStale("introspection");
  if (!stale && Math.hypot(velocity.northMS ?? 0, velocity.eastMS ?? 0) > 0.5) {
    context.strokeStyle = colour("ink");
    context.lineWidth = 1.5;
    heading(context, [x, y], velocity);
  }
  context.save();
  context.translate(x, y);
  context.rotate(headingRad);
  line(context, [[0, -13], [9, 10], [0, 5], [-9, 10]]);
  context.closePath();
  context.fillStyle = stale ? colour("map") : colour("vehicle");
  context.strokeStyle = stale ? colour("bad") : colour("map");
  context.lineWidth = 2;
  if (stale) context.setLineDash([3, 2]);
  context.fill();
  context.stroke();
  context.restore();
  const height = store.doc.aircraft?.derived?.heightM;
  label(pen, `${store.selected}  ${number(height)} m${stale ? "  stale" : ""}`, x + 14, y - 10, stale ? "bad" : "ink");
}

/** A diamond with the aircraft's height and velocity. */
export function traffic(pen, it) {
  if (!it.position) return;
  const { context, colour } = pen;
  const [x, y] = place(it.position);
  line(context, [[x, y - 7], [x + 7, y], [x, y + 7], [x - 7, y]]);
  context.closePath();
  context.strokeStyle = colour("warn");
  context.lineWidth = 2;
  context.stroke();
  heading(context, [x, y], it.velocity);
  label(pen, `${it.id || "traffic"}  ${number(-(it.position.downM ?? 0))} m`, x + 10, y - 6, "warn");
}

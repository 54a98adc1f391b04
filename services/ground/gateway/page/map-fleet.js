// The other vehicles of the fleet, in the frame of the selected one, with labels that do not lie on each other.

import { select, store } from "./store.js";
import { toScreen } from "./map-view.js";
import { label, line } from "./map-pen.js";
import { alarmOf } from "./alarms.js";
import { number } from "./words.js";

/** Metres for a degree of latitude: near enough for a map of some kilometres (WGS 84: 110.6 km at the equator, 111.7 km at the poles). */
const METRES_PER_DEGREE = 111_200;
/** Height of a line of text, in pixels. */
const LINE = 16;

/** Where the other vehicles were drawn, to select one by a click. */
let drawn = [];

/** Every vehicle but the selected one, by its latitude and longitude from those of the selected one. */
export function fleet(pen) {
  const own = store.doc?.aircraft;
  const [here, origin] = [own?.globalPosition, own?.localPosition?.position];
  drawn = [];
  if (!here || !origin) return;
  for (const it of store.vehicles) {
    const there = it.globalPosition;
    if (it.vehicle === store.selected || !there) continue;
    const north = (origin.northM ?? 0) + ((there.latitudeDeg ?? 0) - (here.latitudeDeg ?? 0)) * METRES_PER_DEGREE;
    const narrower = Math.cos(((here.latitudeDeg ?? 0) * Math.PI) / 180);
    const east = (origin.eastM ?? 0) + ((there.longitudeDeg ?? 0) - (here.longitudeDeg ?? 0)) * METRES_PER_DEGREE * narrower;
    drawn.push({ it, at: toScreen(north, east), position: { northM: north, eastM: east } });
  }
  const taken = [];
  drawn.forEach(({ it, at }) => vehicle(pen, it, at, free(taken, at)));
}

/** Where the vehicles of the fleet are, for a view that shows all of them. */
export const fleetPositions = () => drawn.map((it) => it.position);

/** Selects the vehicle that is drawn here; whether there is one. */
export function selectAt(x, y) {
  const hit = drawn.find(({ at }) => Math.hypot(at[0] - x, at[1] - y) < 18);
  if (hit) select(hit.it.vehicle);
  return Boolean(hit);
}

function vehicle(pen, it, [x, y], row) {
  const { context, colour } = pen;
  const lost = it.contact?.lost;
  const tone = lost ? "bad" : it.worst ? alarmOf(it.worstAlarm).tone : "muted";
  context.save();
  context.translate(x, y);
  context.rotate(((it.courseDeg ?? 0) * Math.PI) / 180);
  line(context, [[0, -10], [7, 8], [0, 4], [-7, 8]]);
  context.closePath();
  context.fillStyle = colour("map");
  context.strokeStyle = colour(tone);
  context.lineWidth = 2;
  if (lost) context.setLineDash([3, 2]);
  context.fill();
  context.stroke();
  context.restore();
  label(pen, `${it.vehicle}  ${number(it.heightM)} m${lost ? "  no contact" : ""}`, x + 12, row, tone);
}

/** A height for a label at which no other label is; it is taken then. */
function free(taken, [x, y]) {
  let row = y + 5;
  const hits = () => taken.some((it) => Math.abs(it.x - x) < 150 && Math.abs(it.row - row) < LINE);
  while (hits()) row += LINE;
  taken.push({ x, row });
  return row;
}

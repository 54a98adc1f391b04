// What the present leg has to do with permissions: what is waited for at a border, and what expires before the leg has left its area.

import { store } from "./store.js";
import { clock } from "./words.js";

/** Slower than this the vehicle counts as waiting, in m/s. */
const AT_REST_M_S = 0.5;
/** Points of the leg that are looked at. */
const LOOKED_AT = 200;

/** `waits for A, 0:12 of 0:30, then flies round`; `asked, 0:04 of 0:30` while it flies on; empty if nothing is asked for this area. */
export function awaitedWords(area) {
  const awaited = store.doc?.awaited?.find((it) => it.area === area);
  if (!awaited) return "";
  const { flying, groundSpeedMS = 0 } = store.doc.aircraft?.derived ?? {};
  const span = `${clock(awaited.waitedS)} of ${clock(awaited.limitS)}`;
  return flying && groundSpeedMS < AT_REST_M_S ? `waits for ${area}, ${span}, then flies round` : `asked for ${area}, ${span}`;
}

/** The area that the vehicle waits for at its border, in words; empty if it waits for none. */
export function waitingWords() {
  return (store.doc?.awaited ?? []).map((it) => awaitedWords(it.area)).find((it) => it.startsWith("waits")) ?? "";
}

/** Why the permission of an area does not last for the present leg; empty if it does, or the leg does not touch it. */
export function expiryWords(permission) {
  const left = permission.validForS;
  if (permission.state !== "PERMISSION_STATE_GRANTED" || !left) return "";
  const stay = secondsUntilLeft(store.doc?.areas?.find((it) => it.name === permission.area));
  return stay != null && left < stay ? `expires in ${clock(left)}, before the leg has left the area in ${clock(stay)}` : "";
}

/** Seconds until the present leg, flown as fast as now, has left the area; null if it does not touch it or nothing is flown. */
function secondsUntilLeft(area) {
  const from = store.doc?.aircraft?.localPosition?.position;
  const speed = store.doc?.aircraft?.derived?.groundSpeedMS ?? 0;
  const { current, actionTrack } = store.doc?.plan ?? {};
  const to = actionTrack?.find((it) => it.id === current?.stepId)?.goalState?.position;
  if (!area || !from || !to || speed < AT_REST_M_S) return null;
  const span = [(to.northM ?? 0) - (from.northM ?? 0), (to.eastM ?? 0) - (from.eastM ?? 0)];
  const length = Math.hypot(...span);
  for (let n = LOOKED_AT; n >= 0; n -= 1) {
    const part = n / LOOKED_AT;
    if (isInside(area, (from.northM ?? 0) + part * span[0], (from.eastM ?? 0) + part * span[1])) return (part * length) / speed;
  }
  return null;
}

/** The corners of an area's outline, then those of each hole. */
export function rings({ corners, holes = [] }) {
  return [corners, ...holes.map((it) => it.corners)];
}

/** Whether a place is in an area and outside its holes, by the number of the edges east of the place. */
function isInside(area, north, east) {
  let inside = false;
  for (const corners of rings(area)) {
    corners.forEach((a, index) => {
      const b = corners[(index + 1) % corners.length];
      const [aN, aE, bN, bE] = [a.northM ?? 0, a.eastM ?? 0, b.northM ?? 0, b.eastM ?? 0];
      if (aN > north !== bN > north && east < ((bE - aE) * (north - aN)) / (bN - aN) + aE) inside = !inside;
    });
  }
  return inside;
}

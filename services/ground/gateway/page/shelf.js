// Alarms that the operator has put aside for a time: they come back by themselves, and how many there are is always shown.
//
// The shelf belongs to this browser: other operators see the alarm.

const SHELF = "kittiwake.shelf";

/** Until when each alarm rests, in milliseconds since the Unix epoch. */
const shelf = new Map(Object.entries(JSON.parse(sessionStorage.getItem(SHELF) ?? "{}")));

function keep() {
  for (const [key, until] of shelf) if (until <= Date.now()) shelf.delete(key);
  sessionStorage.setItem(SHELF, JSON.stringify(Object.fromEntries(shelf)));
}

/** Puts an alarm aside for some minutes. */
export function shelve(key, minutes) {
  shelf.set(key, Date.now() + minutes * 60_000);
  keep();
}

/** Whether an alarm rests. */
export const isShelved = (key) => (shelf.get(key) ?? 0) > Date.now();

/** When the first of these comes back, as a time of day. */
export function shelvedUntil(keys) {
  const first = Math.min(...keys.filter(isShelved).map((it) => shelf.get(it)));
  return Number.isFinite(first) ? new Date(first).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" }) : "";
}

/** Shows all of them again. */
export function unshelveAll() {
  shelf.clear();
  keep();
}

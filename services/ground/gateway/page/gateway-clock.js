// How old the gateway's words are when they arrive: what waits before a narrow link arrives as regularly as ever.
//
// The two clocks are compared by what arrived with the least delay; neither has to be right. A clock that is slowed down looks like a queue that
// grows. What tells them apart is an answer, since it was not written before it was asked for: no queue can make that seem otherwise, however
// long it lasts. Nothing here reads a clock.

/** How much the two clocks may drift apart, as a part of the time: a hundred millionths for each crystal. */
const DRIFT = 2e-4;

/**
 * Nothing was heard yet. `least` is the difference of the clocks and the least delay, `at` when it was known, and `newest` the last document
 * of each source: when it was written, and how late it was.
 */
export const NOTHING_HEARD = { least: Infinity, at: -Infinity, newest: {} };

/**
 * What is known after a document of `source` has arrived that was written at `utc` by the gateway's clock, at `at` by this page's. One that
 * answers a request was asked for at `request.asked`, by this page's clock, and may have been written `request.olderBy` before, since the
 * gateway renews its answers only so often. All are in milliseconds. The documents of one source arrive in order.
 */
export function heard(before, source, utc, at, request = null) {
  if (!Number.isFinite(utc)) return before;
  const last = before.newest[source];
  const known = last && utc < last.utc ? setBack(utc, at, last.late) : before;
  const drifted = Math.min(at - utc, known.least + DRIFT * Math.max(0, at - known.at));
  const least = isOfAnotherClock(drifted, last, utc, request) ? request.asked - utc : drifted;
  return { least, at, newest: { ...known.newest, [source]: { utc, late: Math.max(0, at - utc - least) } } };
}

/**
 * The gateway's clock was set back: what was known is of another clock, but for how late things are, since a queue does not end with that.
 * A clock that was set forward has the least delay by itself.
 */
function setBack(utc, at, late) {
  return { least: at - utc - late, at, newest: {} };
}

/**
 * Whether a request was answered, it seems, before it was asked: the gateway's clock has lost time since, in small steps or slowly. An answer
 * with the time of the one before may be of any age: the gateway's loop stands still.
 */
function isOfAnotherClock(least, last, utc, request) {
  return request !== null && last !== undefined && last.utc !== utc && least < request.asked - request.olderBy - utc;
}

/** By how many milliseconds a document arrived later than the quickest of them; 0 where that is not known. */
export function latenessOf({ least }, utc, at) {
  const late = at - utc - least;
  return Number.isFinite(late) ? Math.max(0, late) : 0;
}

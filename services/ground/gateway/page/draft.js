// The places in the text of a mission that is being edited: each can be dragged on the map, and the text follows.

/** A number of TOML, as `1_000.5` or `-3e2`. */
const NUMBER = "[-+]?[\\d_]+(?:\\.[\\d_]+)?(?:[eE][-+]?\\d+)?";
/** An objective or a site: two keys that follow one another. */
const POINT = new RegExp(`^([ \\t]*north_m[ \\t]*=[ \\t]*)(${NUMBER})([^\\n]*\\n[ \\t]*east_m[ \\t]*=[ \\t]*)(${NUMBER})`, "gm");
/** The outline of an area or of a survey, or the holes of an area, over as many lines as there are. */
const RINGS = /(?:corners|holes)_m\s*=\s*\[((?:[^[\]]*\[(?:[^[\]]*\[[^[\]]*\])*[^[\]]*\])*)/g;
const CORNER = new RegExp(`(\\[\\s*)(${NUMBER})(\\s*,\\s*)(${NUMBER})`, "g");

/** Every place in the text: where it is, whether it is a corner, and where its two numbers stand. */
export function placesIn(text) {
  const points = [...text.matchAll(POINT)].map((it) => place(it, it.index, false));
  const corners = [...text.matchAll(RINGS)].flatMap((rings) => {
    const start = rings.index + rings[0].length - rings[1].length;
    return [...rings[1].matchAll(CORNER)].map((it) => place(it, start + it.index, true));
  });
  return [...points, ...corners].sort((a, b) => a.from - b.from);
}

function place([, before, north, between, east], start, isCorner) {
  const from = start + before.length;
  const until = from + north.length + between.length + east.length;
  const value = (it) => Number(it.replaceAll("_", ""));
  return { north: value(north), east: value(east), isCorner, from, until, between };
}

/** The text with this place moved, to a tenth of a metre. */
export function movedTo(text, { from, until, between }, { north, east }) {
  const figure = (it) => (Math.round(it * 10) / 10 || 0).toFixed(1);
  return text.slice(0, from) + figure(north) + between + figure(east) + text.slice(until);
}

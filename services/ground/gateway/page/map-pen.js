// What all drawings on the map share: lines, labels, stripes.

/** A path through points, in pixels. */
export function line(context, points) {
  context.beginPath();
  points.forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)));
}

/** A path along closed rings, in pixels. */
export function outline(context, rings) {
  context.beginPath();
  for (const ring of rings) {
    ring.forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.closePath();
  }
}

/** Text with an outline in the colour of the ground, legible on every background. */
export function label({ context, colour, font, width }, words, x, y, tone = "ink", weight = 600) {
  context.font = `${weight} 14px ${font}`;
  // What is on the map is read to its end: a label at the right edge is moved to the left.
  if (x < width) x = Math.max(4, Math.min(x, width - context.measureText(words).width - 4));
  context.lineJoin = "round";
  context.lineWidth = 3;
  context.strokeStyle = colour("map");
  context.strokeText(words, x, y);
  context.fillStyle = colour(tone);
  context.fillText(words, x, y);
}

/** Stripes, because colour alone is not enough for colour-blind operators, and in bright sun. */
export function hatch({ context, colour }, rings, tone, crossed) {
  context.save();
  outline(context, rings);
  context.clip("evenodd");
  context.globalAlpha = 0.35;
  context.strokeStyle = colour(tone);
  context.lineWidth = 1;
  const [xs, ys] = [rings[0].map((c) => c[0]), rings[0].map((c) => c[1])];
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

/** A velocity as a line from `[x, y]`, four pixels for each metre per second. */
export function heading(context, [x, y], { northMS = 0, eastMS = 0 } = {}) {
  line(context, [[x, y], [x + eastMS * 4, y - northMS * 4]]);
  context.stroke();
}

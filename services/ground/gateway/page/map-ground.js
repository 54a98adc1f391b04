// The ground: a grid in metres, a scale, the wind, and the mark of a place that the operator chooses.

import { nice, pixels, toGround, toScreen } from "./map-view.js";
import { label, line } from "./map-pen.js";
import { number } from "./words.js";

export function grid({ context, width, height, colour }) {
  const step = nice(60);
  const [low, high] = [toGround(0, height), toGround(width, 0)];
  context.lineWidth = 1;
  const draw = (from, to, at) => {
    for (let n = Math.ceil(from / step); n * step <= to; n++) {
      context.strokeStyle = colour(n === 0 ? "axis" : "grid");
      line(context, at(n * step));
      context.stroke();
    }
  };
  const crisp = (it) => Math.round(it) + 0.5;
  draw(low.east, high.east, (e) => [[crisp(toScreen(0, e)[0]), 0], [crisp(toScreen(0, e)[0]), height]]);
  draw(low.north, high.north, (n) => [[0, crisp(toScreen(n, 0)[1])], [width, crisp(toScreen(n, 0)[1])]]);
}

export function scaleBar(pen) {
  const { context, colour, height } = pen;
  const metres = nice(60);
  const [x, y, end] = [14, height - 14, 14 + pixels(metres)];
  context.strokeStyle = colour("ink");
  context.lineWidth = 2;
  line(context, [[x, y - 5], [x, y], [end, y], [end, y - 5]]);
  context.stroke();
  label(pen, metres >= 1000 ? `${metres / 1000} km` : `${metres} m`, x + 6, y - 7, "ink", 500);
}

/** An arrow that points where the wind blows to. */
export function wind(pen, it) {
  if (!it) return;
  const { context, colour, width } = pen;
  const speed = Math.hypot(it.northMS ?? 0, it.eastMS ?? 0);
  context.save();
  context.translate(width - 44, 74);
  if (speed > 0.2) {
    context.rotate(Math.atan2(it.eastMS ?? 0, it.northMS ?? 0));
    context.strokeStyle = colour("ink");
    context.lineWidth = 2;
    line(context, [[0, 16], [0, -16], [-5, -9], [0, -16], [5, -9]]);
    context.stroke();
  }
  context.restore();
  label(pen, `wind ${number(speed, 1)} m/s`, width - 118, 108);
}

export function mark({ context, colour }, { north, east }) {
  const [x, y] = toScreen(north, east);
  context.strokeStyle = colour("bad");
  context.lineWidth = 2;
  line(context, [[x - 14, y], [x + 14, y]]);
  context.stroke();
  line(context, [[x, y - 14], [x, y + 14]]);
  context.stroke();
  context.beginPath();
  context.arc(x, y, 9, 0, 2 * Math.PI);
  context.stroke();
}

// Height, speed, battery and the tree's tick time over the last minutes.

import { fit, h, text, theme } from "./dom.js";
import { isSourceStale, store } from "./store.js";
import { clock, number } from "./words.js";

const PLOTS = [
  { key: "height", label: "Height", unit: "m", decimals: 1, least: 15 },
  { key: "speed", label: "Ground speed", unit: "m/s", decimals: 1, least: 5 },
  { key: "battery", label: "Battery", unit: "%", decimals: 0, least: 100 },
  { key: "tick", below: "tickMedian", label: "Tick time, max", unit: "ms", decimals: 2, least: 1, else: { key: "ticks", label: "Tree ticks", unit: "/s", decimals: 0, least: 10 } },
];

/** Milliseconds between two samples that are not joined: the vehicle was not heard meanwhile. */
const GAP_MS = 2500;

/** Mission time under the pointer, the same in all plots. */
let pointed = null;

export function mountPlots() {
  const panel = document.getElementById("plots");
  const plots = PLOTS.map((plot) => {
    const label = h("span", { class: "label" }, plot.label);
    const value = h("b", { class: "figure" });
    const canvas = h("canvas", { role: "img" });
    canvas.addEventListener("pointermove", (event) => {
      const [first, last] = range();
      pointed = first + (event.offsetX / canvas.clientWidth) * (last - first);
      renew();
    });
    canvas.addEventListener("pointerleave", () => {
      pointed = null;
      renew();
    });
    panel.append(h("figure", { class: "plot" }, h("figcaption", {}, label, value), canvas));
    return { plot, label, value, canvas };
  });
  let drawn = "";
  const renew = () => plots.forEach(draw);
  return () => {
    const state = [store.samples.length, store.samples.at(-1)?.at, isSourceStale("introspection"), document.documentElement.dataset.theme, matchMedia("(prefers-color-scheme: dark)").matches, panel.clientWidth].join();
    if (state === drawn) return;
    drawn = state;
    renew();
  };
}

function range() {
  const last = store.samples.at(-1)?.at ?? 0;
  return [Math.min(store.samples[0]?.at ?? 0, last - 10), last];
}

function draw({ plot, label, value, canvas }) {
  // Without tick times, where nothing is timed, the number of ticks is shown.
  const known = !plot.else || store.samples.some((it) => it[plot.key] != null);
  const shown = known ? plot : plot.else;
  const samples = store.samples.filter((it) => it[shown.key] != null);
  text(label, shown.label);
  const { context, width, height } = fit(canvas);
  if (!samples.length) return text(value, "–");
  const colour = theme();
  const [first, last] = range();
  const top = Math.max(shown.least, ...samples.map((it) => it[shown.key])) * 1.05;
  const x = (at) => ((at - first) / (last - first)) * (width - 1);
  const y = (it) => height - 1 - (it / top) * (height - 14);
  context.font = `14px ${getComputedStyle(canvas).fontFamily}`;
  context.strokeStyle = colour("line");
  context.fillStyle = colour("muted");
  for (const fraction of [0, 0.5, 1]) {
    const at = Math.round(y((top / 1.05) * fraction)) + 0.5;
    context.beginPath();
    context.moveTo(0, at);
    context.lineTo(width, at);
    context.stroke();
    if (fraction) context.fillText(number((top / 1.05) * fraction, top < 20 && fraction < 1 ? 1 : 0), 2, at - 2);
  }
  const curve = (key, tone) => {
    context.strokeStyle = colour(tone);
    context.lineWidth = 1.5;
    context.beginPath();
    samples.forEach((it, index) => {
      const joined = index && it.seenAt - samples[index - 1].seenAt < GAP_MS;
      context[joined ? "lineTo" : "moveTo"](x(it.at), y(it[key] ?? 0));
    });
    context.stroke();
  };
  if (shown.below) curve(shown.below, "muted");
  curve(shown.key, isSourceStale("introspection") ? "muted" : "accent");
  const nearest = pointed == null ? samples.at(-1) : samples.reduce((a, b) => (Math.abs(a.at - pointed) < Math.abs(b.at - pointed) ? a : b));
  if (pointed != null) {
    context.strokeStyle = colour("muted");
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x(nearest.at), 0);
    context.lineTo(x(nearest.at), height);
    context.stroke();
  }
  context.fillStyle = colour("ink");
  context.beginPath();
  context.arc(x(nearest.at), y(nearest[shown.key]), 2.5, 0, 2 * Math.PI);
  context.fill();
  text(value, `${number(nearest[shown.key], shown.decimals)} ${shown.unit}${pointed == null ? "" : ` at ${clock(nearest.at)}`}`);
  canvas.setAttribute("aria-label", `${shown.label}: ${number(nearest[shown.key], shown.decimals)} ${shown.unit}`);
}

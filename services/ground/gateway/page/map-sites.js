// Where the flight may end early: the mission's sites, and how they are reached from where the vehicle is.

import { store } from "./store.js";
import { place } from "./map-view.js";
import { label, line } from "./map-pen.js";
import { number } from "./words.js";

const ROLE = "ALTERNATE_ROLE_SITE";

export function alternates(pen) {
  const { context, colour } = pen;
  const ways = store.doc.alternates ?? [];
  for (const site of store.doc.sites ?? []) {
    const [x, y] = place(site.position);
    const way = ways.find((it) => it.role === ROLE && it.name === site.name);
    const tone = way?.whyNot ? "bad" : "ink";
    context.strokeStyle = colour(tone);
    context.lineWidth = 2;
    // A diamond to land in, a cross to ditch at.
    if (site.kind === "SITE_KIND_DITCH") {
      line(context, [[x - 6, y - 6], [x + 6, y + 6]]);
      context.stroke();
      line(context, [[x - 6, y + 6], [x + 6, y - 6]]);
    } else {
      line(context, [[x, y - 8], [x + 8, y], [x, y + 8], [x - 8, y]]);
      context.closePath();
    }
    context.stroke();
    label(pen, `${site.kind === "SITE_KIND_DITCH" ? "ditch " : ""}${site.name}${reach(way)}`, x + 12, y + 5, tone);
  }
}

function reach(way) {
  if (!way) return "";
  if (way.whyNot) return ", not in reach";
  const asks = way.permissions?.length ? `, asks for ${way.permissions.join(", ")}` : "";
  return `, ${number(way.lengthM)} m, ${number(way.energyWh)} Wh${asks}`;
}

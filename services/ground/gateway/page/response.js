// The response under way in words.

import { capital, clock, flag } from "./words.js";

/** `home, down in 0:35`. */
export function responseWords({ destination, lands, timeS }) {
  return `${destination}, ${lands ? "down" : "there"} in ${clock(timeS)}`;
}

/** The first of a row's actions: what comes only if it fails is shown with the contingency. */
export const firstAction = (it) => flag((it || "").split(", else")[0]);

/** `Return home: battery low. Home, down in 0:35. The mission is over after it.`; empty if nothing responds. */
export function responding(doc) {
  const acting = doc?.contingencies?.active?.find((it) => it.flag === doc.contingencies.acting);
  if (!acting) return "";
  const { way, ends } = doc.contingencies;
  const sentences = [`${capital(firstAction(acting.action))}: ${flag(acting.flag)}`];
  if (way) sentences.push(capital(responseWords(way)));
  if (ends) sentences.push("The mission ends with it");
  return `${sentences.join(". ")}.`;
}

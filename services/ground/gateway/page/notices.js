// Where an alarm is noticed by who does not look: the sound, and the system's notifications where they are allowed.

import { attribute, h, text } from "./dom.js";

const MUTED = "kittiwake.muted";

/** Two switches beside the session; returns what beeps, and what notifies in words. */
export function mountNotices() {
  return { sound: mountSound(), notify: mountNotifications() };
}

/** Asked for once, by a click; shown only while the page is in the background. */
function mountNotifications() {
  if (!("Notification" in window)) return () => {};
  const button = h("button", { id: "alarm-notify", click: () => Notification.requestPermission().then(show) });
  document.getElementById("session").append(button);
  const show = () => {
    attribute(button, "hidden", Notification.permission !== "default");
    text(button, "Allow notifications");
  };
  show();
  return (lines) => {
    if (Notification.permission !== "granted" || !document.hidden) return;
    // The same tag: a newer notification takes the place of the one before, and none pile up.
    new Notification("Kittiwake", { body: lines.join("\n"), tag: "kittiwake-alarm", renotify: true });
  };
}

/** A switch that shows whether alarms are heard; returns what beeps. */
function mountSound() {
  let context = null;
  const button = h("button", { id: "alarm-sound", "aria-pressed": "false", click: () => toggle() });
  document.getElementById("session").append(button);
  const muted = () => localStorage.getItem(MUTED) === "true";
  const show = () => {
    attribute(button, "aria-pressed", muted() ? "false" : "true");
    // Browsers play nothing before the page was clicked.
    text(button, muted() ? "Sound off" : context?.state === "running" ? "Sound on" : "Sound: click to hear");
  };
  const wake = () => {
    context ??= new AudioContext();
    context.resume().then(show);
  };
  const toggle = () => {
    // A first click hears; only then it silences.
    if (context?.state === "running") localStorage.setItem(MUTED, muted() ? "false" : "true");
    wake();
    show();
  };
  document.addEventListener("click", wake, { once: true });
  show();
  return (beeps) => {
    if (muted() || context?.state !== "running") return;
    for (let n = 0; n < beeps; n += 1) beep(context, context.currentTime + n * 0.25);
  };
}

function beep(context, at) {
  const [tone, volume] = [context.createOscillator(), context.createGain()];
  tone.frequency.value = 880;
  volume.gain.setValueAtTime(0.2, at);
  volume.gain.exponentialRampToValueAtTime(0.001, at + 0.18);
  tone.connect(volume).connect(context.destination);
  tone.start(at);
  tone.stop(at + 0.2);
}

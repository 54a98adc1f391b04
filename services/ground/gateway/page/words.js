// Enumerations, numbers and times as an operator reads them.

/** `FLIGHT_MODE_OFFBOARD` -> `offboard`, given the prefix. */
export function name(value, prefix) {
  if (!value || value === `${prefix}_UNSPECIFIED`) return "";
  return value.replace(`${prefix}_`, "").toLowerCase().replaceAll("_", " ");
}

export const phase = (it) => name(it, "MISSION_PHASE") || "no data";
export const outcome = (it) => name(it, "MISSION_OUTCOME");
export const mode = (it) => name(it, "FLIGHT_MODE") || "no data";
export const permission = (it) => name(it, "PERMISSION_STATE") || "not requested";
export const objective = (it) => name(it, "OBJECTIVE_STATE") || "unknown";
export const skill = (it) => name(it, "SKILL_KIND");

/** A number with its decimals; a dash for what is unknown. */
export function number(value, decimals = 0) {
  if (value == null || !Number.isFinite(Number(value))) return "–";
  const shown = Number(value).toFixed(decimals);
  return (Number(shown) === 0 ? shown.replace("-", "") : shown).replace("-", "−");
}

/** Seconds as `1:02:03`, `2:03`. */
export function clock(seconds) {
  if (seconds == null || !Number.isFinite(seconds)) return "–";
  const all = Math.max(0, Math.floor(seconds));
  const two = (it) => String(it).padStart(2, "0");
  const [hours, minutes] = [Math.floor(all / 3600), Math.floor(all / 60) % 60];
  return hours ? `${hours}:${two(minutes)}:${two(all % 60)}` : `${minutes}:${two(all % 60)}`;
}

/** An age: `0.2 s`, `14 s`, `3 min`. */
export function age(seconds) {
  if (seconds == null || !Number.isFinite(seconds)) return "never";
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  return seconds < 120 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`;
}

/** `obstacle_near` -> `obstacle near`. */
export const flag = (it) => (it || "").replaceAll("_", " ");

/** With a capital letter. */
export function capital(it) {
  return it ? it[0].toUpperCase() + it.slice(1) : "";
}

/** With a capital letter and a full stop. */
export function sentence(it) {
  const trimmed = (it || "").trim();
  if (!trimmed) return "";
  return /[.!?]$/.test(trimmed) ? capital(trimmed) : `${capital(trimmed)}.`;
}

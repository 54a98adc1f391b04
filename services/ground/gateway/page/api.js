// Requests to the gateway: the token, the idempotency key, and refusals as errors with their reason.

const TOKEN = "kittiwake.token";

/** Moves the token of the printed link out of the address, so that it does not stay visible. */
export function adoptToken() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (!given) return;
  keepToken(given);
  history.replaceState(null, "", location.pathname + location.search);
}

/** Keeps a token while this tab is open. */
export function keepToken(token) {
  sessionStorage.setItem(TOKEN, token.trim());
}

/** A request that was refused; the status is 0 if there was no answer. */
export class Refusal extends Error {
  constructor(status, detail, document = {}) {
    super(detail);
    this.status = status;
    this.document = document;
  }
}

function headers(more) {
  const token = sessionStorage.getItem(TOKEN);
  return token ? { ...more, Authorization: `Bearer ${token}` } : more;
}

/** A key that no other order has; an order that is repeated keeps its key. */
export function newKey() {
  const bytes = crypto.getRandomValues(new Uint8Array(12));
  return [...bytes].map((it) => it.toString(16).padStart(2, "0")).join("");
}

async function refusal(response) {
  const document = await response.json().catch(() => null);
  const foreign = `answer ${response.status}, which is not the gateway's: a proxy on the way does not reach it`;
  return new Refusal(response.status, document ? document.detail || document.title || `answer ${response.status}` : foreign, document ?? {});
}

async function send(path, options) {
  try {
    return await fetch(path, { ...options, cache: "no-store", signal: options.signal ?? AbortSignal.timeout(10_000) });
  } catch (error) {
    if (options.signal?.aborted) throw error;
    throw new Refusal(0, "the gateway does not answer");
  }
}

/** Reads a document. */
export async function get(path) {
  const response = await send(path, { headers: headers({ Accept: "application/json" }) });
  if (!response.ok) throw await refusal(response);
  return response.json();
}

/** Downloads a file; a link could not carry the token. */
export async function save(path, name) {
  const response = await send(path, { headers: headers({}), signal: new AbortController().signal });
  if (!response.ok) throw await refusal(response);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await response.blob());
  link.download = name;
  link.click();
  // The browser has the file by then.
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** Gives an order with an optional JSON body, under a key. */
export async function command(method, path, body, key = newKey()) {
  const more = { Accept: "application/json", "Idempotency-Key": key };
  if (body !== undefined) more["Content-Type"] = "application/json";
  const response = await send(path, { method, headers: headers(more), body: body && JSON.stringify(body) });
  if (!response.ok) throw await refusal(response);
  return response.json();
}

/**
 * Reads an event stream until it ends or `signal` aborts it. `EventSource` cannot send a token,
 * so the lines are read here: `id:`, `event:`, `data:`, an empty line ends an event.
 */
export async function stream(path, lastEventId, signal, onEvent) {
  const more = { Accept: "text/event-stream" };
  if (lastEventId) more["Last-Event-ID"] = lastEventId;
  const response = await send(path, { headers: headers(more), signal });
  if (!response.ok) throw await refusal(response);
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let waiting = "";
  let event = { id: null, type: "message", data: [] };
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    const lines = (waiting + value).split(/\r?\n/);
    waiting = lines.pop();
    for (const line of lines) {
      if (line === "") {
        if (event.data.length) onEvent(event.id, event.type, JSON.parse(event.data.join("\n")));
        event = { id: null, type: "message", data: [] };
      } else if (line.startsWith("id:")) event.id = line.slice(3).trim();
      else if (line.startsWith("event:")) event.type = line.slice(6).trim();
      else if (line.startsWith("data:")) event.data.push(line.slice(5).trimStart());
    }
  }
}

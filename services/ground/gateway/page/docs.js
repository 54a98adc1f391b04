// Shows the OpenAPI document.
const element = (tag, text, parent) => {
  const it = document.createElement(tag)
  it.textContent = text ?? ""
  parent?.append(it)
  return it
}
const fold = (title, value, parent) => {
  const details = element("details", "", parent)
  const summary = element("summary", "", details)
  title(summary)
  element("pre", JSON.stringify(value, null, 2), details)
}
/** The known kinds of problems, and what the description of their type says of each on a line of its own. */
const problems = ({ examples = [], description = "" }) => examples.map((uri) => {
  const start = `- \`${uri}\`: `
  const line = description.split("\n").find((it) => it.startsWith(start)) ?? start
  return [uri, line.slice(start.length)]
})
const show = (api) => {
  const main = document.getElementById("operations")
  main.textContent = ""
  for (const [path, operations] of Object.entries(api.paths)) {
    for (const [method, operation] of Object.entries(operations)) {
      fold((summary) => {
        element("span", method, summary).className = "method"
        element("code", path, summary)
        element("span", ` ${operation.summary} `, summary)
        const roles = operation.security.flatMap((it) => it.bearer)
        element("span", roles.length ? `(${roles.join(", ")})` : "", summary).className = "roles"
      }, operation, main)
    }
  }
  for (const [uri, words] of problems(api.components.schemas["kittiwake.v1.Problem"].properties.type)) {
    element("code", uri, element("dt", "", document.getElementById("problems")))
    element("dd", words, document.getElementById("problems"))
  }
  for (const [name, schema] of Object.entries(api.components.schemas)) {
    fold((summary) => element("code", name, summary), schema, document.getElementById("schemas"))
  }
}
fetch("/openapi.json").then((it) => it.json()).then(show)

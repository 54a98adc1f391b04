//! Whether an answer is what the OpenAPI document says of its route: JSON Schema, as far as that document uses it.

#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

use serde_json::{Map, Value};

/// The items of `required` are distinct: JSON Schema 2020-12, section 6.5.3.
#[track_caller]
fn expect_each_required_once(schema: &Value) {
    if let Some(required) = schema["required"].as_array() {
        let again = required.iter().enumerate().find(|(index, name)| required[..*index].contains(name));
        assert_eq!(again, None, "{schema}");
    }
    let members = schema.as_object().into_iter().flat_map(|it| it.values());
    members.chain(schema.as_array().into_iter().flatten()).for_each(expect_each_required_once);
}

/// An OpenAPI document.
pub struct Description(Value);

impl Description {
    pub fn new(document: Value) -> Description {
        expect_each_required_once(&document);
        Description(document)
    }

    /// The paths of the routes with this method.
    pub fn paths(&self, method: &str) -> Vec<String> {
        let all = self.0["paths"].as_object().into_iter().flatten();
        all.filter(|(_, operations)| operations.get(method).is_some()).map(|(path, _)| path.clone()).collect()
    }

    /// Fails unless the answer is described.
    #[track_caller]
    pub fn check(&self, method: &str, path: &str, status: u16, media_type: &str, body: &Value) {
        // What no route matches is answered with a problem.
        let problem = "#/components/schemas/kittiwake.v1.Problem";
        let response = self.operation(method, path).map(|it| {
            let responses = &it["responses"];
            responses.get(status.to_string()).unwrap_or(&responses["default"])
        });
        let content = response.map(|it| it["content"].as_object().expect("a response has a content"));
        let named = |kind: &str| kind == media_type || kind == "*/*";
        let described = content.map(|it| it.iter().find(|(kind, _)| named(kind.split(';').next().unwrap_or(kind))));
        match described {
            None => self
                .fits(&serde_json::json!({ "$ref": problem }), body, "")
                .unwrap_or_else(|why| panic!("{method} {path}: {status} {why}")),
            Some(None) => panic!("{method} {path}: {status} with {media_type} is not described"),
            Some(Some((_, media))) => {
                // Of a stream each event is described, and checked as it comes.
                if let Some(schema) = media.get("schema").filter(|_| media_type != "text/event-stream") {
                    self.fits(schema, body, "").unwrap_or_else(|why| panic!("{method} {path}: {status} {why}"));
                }
            }
        }
    }

    /// Fails unless the data of an event of this kind are described.
    #[track_caller]
    pub fn check_event(&self, kind: &str, data: &Value) {
        let operation = self.operation("get", "/api/v1/vehicles/uav1/events").expect("the stream is described");
        let stream = &operation["responses"]["200"]["content"]["text/event-stream"];
        let schema = stream["x-events"].get(kind).unwrap_or_else(|| panic!("the event `{kind}` is not described"));
        for schema in [schema, &stream["schema"]] {
            self.fits(schema, data, "").unwrap_or_else(|why| panic!("event {kind}: {why}"));
        }
    }

    /// The operation of a request; templates with fewer parameters first, as the router has it.
    fn operation(&self, method: &str, path: &str) -> Option<&Value> {
        let path = path.split('?').next().unwrap_or(path);
        let matches = |template: &str| {
            let (asked, known) = (path.split('/').collect::<Vec<_>>(), template.split('/').collect::<Vec<_>>());
            asked.len() == known.len()
                && asked.iter().zip(known).all(|(asked, known)| known.starts_with('{') || *asked == known)
        };
        let mut found: Vec<_> = self.0["paths"].as_object()?.iter().filter(|(it, _)| matches(it)).collect();
        found.sort_by_key(|(template, _)| template.matches('{').count());
        found.first().and_then(|(_, it)| it.get(method.to_lowercase()))
    }

    /// # Errors
    /// Where the value differs from the schema, and how.
    fn fits(&self, schema: &Value, value: &Value, at: &str) -> Result<(), String> {
        let refused = |why: &str| Err(format!("{at}: {why}: {value}"));
        for (keyword, rule) in schema.as_object().into_iter().flatten() {
            match keyword.as_str() {
                "$ref" => {
                    let name = rule.as_str().and_then(|it| it.rsplit('/').next()).unwrap_or_default();
                    self.fits(self.0["components"]["schemas"].get(name).expect(name), value, at)?;
                }
                "type" if !is_of_type(value, rule) => return refused(&format!("is not of type {rule}")),
                "enum" if !rule.as_array().is_some_and(|it| it.contains(value)) => return refused("is not listed"),
                "const" if value != rule => return refused(&format!("is not {rule}")),
                "anyOf" => {
                    let mut alternatives = rule.as_array().into_iter().flatten();
                    if !alternatives.any(|it| self.fits(it, value, at).is_ok()) {
                        return refused("fits none of the alternatives");
                    }
                }
                "allOf" => rule.as_array().into_iter().flatten().try_for_each(|it| self.fits(it, value, at))?,
                "oneOf" => {
                    let fitting = rule.as_array().into_iter().flatten().filter(|it| self.fits(it, value, at).is_ok());
                    if fitting.count() != 1 {
                        return refused("fits none of the alternatives, or several");
                    }
                }
                "minimum" if value.as_f64() < rule.as_f64() => return refused(&format!("is below {rule}")),
                "required" => {
                    let missing = |name: &&Value| name.as_str().is_some_and(|it| value.get(it).is_none());
                    if let Some(name) = rule.as_array().into_iter().flatten().find(missing) {
                        return refused(&format!("lacks {name}"));
                    }
                }
                "items" => {
                    for (n, item) in value.as_array().into_iter().flatten().enumerate() {
                        self.fits(rule, item, &format!("{at}/{n}"))?;
                    }
                }
                "properties" | "additionalProperties" => {
                    let none = Map::new();
                    let properties = schema["properties"].as_object().unwrap_or(&none);
                    for (name, member) in value.as_object().into_iter().flatten() {
                        let inner = format!("{at}/{name}");
                        match (properties.get(name), schema.get("additionalProperties")) {
                            (Some(property), _) => self.fits(property, member, &inner)?,
                            (None, Some(Value::Bool(false))) => return Err(format!("{inner}: may not be there")),
                            (None, Some(other)) => self.fits(other, member, &inner)?,
                            (None, None) => {}
                        }
                    }
                }
                "type" | "enum" | "const" | "description" | "examples" | "minimum" | "format" | "contentEncoding"
                | "minLength" | "maxLength" => {}
                other => panic!("the test does not know the keyword `{other}`"),
            }
        }
        Ok(())
    }
}

fn is_of_type(value: &Value, name: &Value) -> bool {
    match name.as_str() {
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("boolean") => value.is_boolean(),
        Some("number") => value.is_number(),
        Some("integer") => value.is_i64() || value.is_u64(),
        _ => panic!("the test does not know the type {name}"),
    }
}

//! Descriptions of the contract's messages for others: JSON Schemas of their canonical proto3 JSON, for
//! OpenAPI documents, and file descriptors of their bytes, for recordings.

use prost::Message as _;
use prost_reflect::{EnumDescriptor, FieldDescriptor, FileDescriptor, Kind, MessageDescriptor};
use prost_types::FileDescriptorSet;
use serde_json::{Map, Value, json};

use crate::json::pool;

/// Every message and enum by its full name, each with references to others as `#/components/schemas/<name>`.
pub fn schemas() -> Map<String, Value> {
    let messages = pool().all_messages().map(|it| (it.full_name().to_owned(), message(&it)));
    let enums = pool().all_enums().map(|it| (it.full_name().to_owned(), enumeration(&it)));
    messages.chain(enums).collect()
}

/// A reference to a schema of [`schemas`].
pub fn reference(full_name: &str) -> Value {
    json!({ "$ref": format!("#/components/schemas/{full_name}") })
}

/// The file that declares the message and all that it builds on, those that others import first, as an
/// encoded `google.protobuf.FileDescriptorSet`; `None` for a name that is not in the contract.
pub fn file_descriptor_set(full_name: &str) -> Option<Vec<u8>> {
    let declared = pool().get_message_by_name(full_name)?.parent_file();
    let mut files = Vec::new();
    collect(&declared, &mut files);
    let file = files.iter().map(|it: &FileDescriptor| it.file_descriptor_proto().clone()).collect();
    Some(FileDescriptorSet { file }.encode_to_vec())
}

fn collect(file: &FileDescriptor, into: &mut Vec<FileDescriptor>) {
    if into.iter().all(|it| it.name() != file.name()) {
        file.dependencies().for_each(|it| collect(&it, into));
        into.push(file.clone());
    }
}

fn message(it: &MessageDescriptor) -> Value {
    let properties: Map<_, _> = it.fields().map(|field| (field.json_name().to_owned(), property(&field))).collect();
    json!({ "type": "object", "properties": properties, "additionalProperties": false })
}

fn enumeration(it: &EnumDescriptor) -> Value {
    let names: Vec<_> = it.values().map(|value| value.name().to_owned()).collect();
    json!({ "type": "string", "enum": names })
}

fn property(field: &FieldDescriptor) -> Value {
    let one = kind(&field.kind());
    if field.is_list() { json!({ "type": "array", "items": one }) } else { one }
}

/// As the canonical JSON mapping has it: 64-bit integers are strings, floating point may be `NaN`.
fn kind(kind: &Kind) -> Value {
    match kind {
        Kind::Double | Kind::Float => {
            json!({ "oneOf": [{ "type": "number" }, { "enum": ["NaN", "Infinity", "-Infinity"] }] })
        }
        Kind::Int32 | Kind::Sint32 | Kind::Sfixed32 => json!({ "type": "integer", "format": "int32" }),
        Kind::Uint32 | Kind::Fixed32 => json!({ "type": "integer", "minimum": 0 }),
        Kind::Int64 | Kind::Sint64 | Kind::Sfixed64 => json!({ "type": "string", "format": "int64" }),
        Kind::Uint64 | Kind::Fixed64 => json!({ "type": "string", "format": "uint64" }),
        Kind::Bool => json!({ "type": "boolean" }),
        Kind::String => json!({ "type": "string" }),
        Kind::Bytes => json!({ "type": "string", "contentEncoding": "base64" }),
        Kind::Message(it) => reference(it.full_name()),
        Kind::Enum(it) => reference(it.full_name()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_descriptor_set_is_all_that_a_stranger_needs() {
        #[track_caller]
        fn check(name: &str, files: &[&str]) {
            let set = FileDescriptorSet::decode(file_descriptor_set(name).unwrap().as_slice()).unwrap();
            assert_eq!(set.file.iter().map(|it| it.name()).collect::<Vec<_>>(), files);
            let pool = prost_reflect::DescriptorPool::from_file_descriptor_set(set).unwrap();
            assert!(pool.get_message_by_name(name).is_some());
        }
        let files = ["fmu", "skill", "planner", "mcm"].map(|it| format!("kittiwake/v1/{it}.proto"));
        check("kittiwake.v1.McmStatus", &files.each_ref().map(|it| it.as_str()));
        check("kittiwake.v1.Heartbeat", &["kittiwake/v1/health.proto"]);
        assert_eq!(file_descriptor_set("kittiwake.v1.Nothing"), None);
    }

    #[test]
    fn every_reference_leads_somewhere() {
        let all = schemas();
        let text = Value::Object(all.clone()).to_string();
        let references = text.split("#/components/schemas/").skip(1).filter_map(|it| it.split('"').next());
        for name in references {
            assert!(all.contains_key(name), "{name}");
        }
        assert_eq!(all["kittiwake.v1.DecidePlan"]["properties"]["revision"]["format"], "uint64");
    }
}

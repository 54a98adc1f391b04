//! Descriptions of the contract's messages for others: JSON Schemas of their canonical proto3 JSON, for
//! OpenAPI documents, and file descriptors of their bytes, for recordings.

use std::collections::BTreeSet;

use prost::Message as _;
use prost_reflect::{EnumDescriptor, FieldDescriptor, FileDescriptor, Kind, MessageDescriptor};
use prost_types::{FileDescriptorProto, FileDescriptorSet};
use serde_json::{Map, Value, json};

use crate::json::pool;

/// Every message and enum by its full name, each with references to others as `#/components/schemas/<name>`.
///
/// `requests` are the messages that others send, by their full names. They and what they consist of may leave out
/// any field and have no others; every other message always has the fields without presence, and may get more.
pub fn schemas(requests: &[String]) -> Map<String, Value> {
    let mut sent = BTreeSet::new();
    requests.iter().filter_map(|name| pool().get_message_by_name(name)).for_each(|it| collect_parts(&it, &mut sent));
    let messages = pool().all_messages().filter(|it| is_ours(it.full_name()) && !it.is_map_entry());
    let messages = messages.map(|it| (it.full_name().to_owned(), message(&it, sent.contains(it.full_name()))));
    let enums = pool().all_enums().filter(|it| is_ours(it.full_name()));
    messages.chain(enums.map(|it| (it.full_name().to_owned(), enumeration(&it)))).collect()
}

/// A reference to a schema of [`schemas`].
pub fn reference(full_name: &str) -> Value {
    json!({ "$ref": format!("#/components/schemas/{full_name}") })
}

/// The file that declares the message and all that it builds on, those that others import first, as an
/// encoded `google.protobuf.FileDescriptorSet` without comments; `None` for a name that is not in the contract.
pub fn file_descriptor_set(full_name: &str) -> Option<Vec<u8>> {
    let declared = pool().get_message_by_name(full_name)?.parent_file();
    let mut files = Vec::new();
    collect_files(&declared, &mut files);
    let without_comments =
        |it: &FileDescriptor| FileDescriptorProto { source_code_info: None, ..it.file_descriptor_proto().clone() };
    let file = files.iter().map(without_comments).collect();
    Some(FileDescriptorSet { file }.encode_to_vec())
}

fn collect_files(file: &FileDescriptor, into: &mut Vec<FileDescriptor>) {
    if into.iter().all(|it| it.name() != file.name()) {
        file.dependencies().for_each(|it| collect_files(&it, into));
        into.push(file.clone());
    }
}

/// Not one of protobuf's own, which the contract uses for JSON of any form.
fn is_ours(full_name: &str) -> bool {
    !full_name.starts_with("google.protobuf.")
}

/// The names of a message and of all messages in it.
fn collect_parts(message: &MessageDescriptor, into: &mut BTreeSet<String>) {
    if into.insert(message.full_name().to_owned()) {
        let kinds = message.fields().map(|field| field.kind());
        kinds.filter_map(|kind| kind.as_message().cloned()).for_each(|part| collect_parts(&part, into));
    }
}

fn message(it: &MessageDescriptor, is_sent: bool) -> Value {
    let properties: Map<_, _> = it.fields().map(|field| (field.json_name().to_owned(), property(&field))).collect();
    if is_sent {
        return json!({ "type": "object", "properties": properties, "additionalProperties": false });
    }
    let always = it.fields().filter(|field| !field.supports_presence());
    let required: Vec<_> = always.map(|field| field.json_name().to_owned()).collect();
    json!({ "type": "object", "properties": properties, "required": required })
}

fn enumeration(it: &EnumDescriptor) -> Value {
    let names: Vec<_> = it.values().map(|value| value.name().to_owned()).collect();
    json!({ "type": "string", "enum": names })
}

fn property(field: &FieldDescriptor) -> Value {
    match field.kind() {
        Kind::Message(entry) if field.is_map() => {
            json!({ "type": "object", "additionalProperties": kind(&entry.map_entry_value_field().kind()) })
        }
        one if field.is_list() => json!({ "type": "array", "items": kind(&one) }),
        one => kind(&one),
    }
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
        Kind::Message(it) => match it.full_name() {
            "google.protobuf.Value" => json!({}),
            "google.protobuf.ListValue" => json!({ "type": "array", "items": {} }),
            name => reference(name),
        },
        Kind::Enum(it) => reference(it.full_name()),
    }
}

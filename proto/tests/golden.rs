//! What is on the wire stays as it is: every field of every message, by its number.
//!
//! Processes of two versions talk to each other during an upgrade, and recordings outlive the version that wrote them. So a field keeps its
//! number, its kind and its name (which the JSON has) for ever; one that is not used any more leaves its number to a `reserved`.

use std::collections::BTreeSet;
use std::path::Path;

use kittiwake_proto::json::pool;
use kittiwake_proto::topics::{Service, Topic};
use prost_reflect::{FieldDescriptor, Kind};

/// The present contract, a line for each field, value, topic and service.
fn present() -> BTreeSet<String> {
    let ours = |name: &str| name.starts_with("kittiwake.");
    let messages = pool().all_messages().filter(|it| ours(it.full_name()));
    let fields = messages.flat_map(|it| it.fields().map(|field| line(&field)).collect::<Vec<_>>());
    let enums = pool().all_enums().filter(|it| ours(it.full_name()));
    let values = enums.flat_map(|it| {
        let of = |value: prost_reflect::EnumValueDescriptor| {
            format!("{} {} {}", it.full_name(), value.number(), value.name())
        };
        it.values().map(of).collect::<Vec<_>>()
    });
    let topics = Topic::ALL.iter().map(|it| format!("topic {} {}", it.key(), it.type_name()));
    let services = Service::ALL.iter().map(|it| format!("service {}", it.key()));
    fields.chain(values).chain(topics).chain(services).collect()
}

fn line(field: &FieldDescriptor) -> String {
    let kind = match field.kind() {
        Kind::Message(it) => it.full_name().to_owned(),
        Kind::Enum(it) => it.full_name().to_owned(),
        scalar => format!("{scalar:?}"),
    };
    let (message, number, name) = (field.parent_message(), field.number(), field.name());
    let how = match (field.is_list(), field.is_map(), field.supports_presence()) {
        (true, ..) => "list of ",
        (_, true, _) => "map of ",
        (.., true) => "optional ",
        _ => "",
    };
    format!("{} {number} {name}: {how}{kind}", message.full_name())
}

#[test]
fn no_field_changes_its_number_its_kind_or_its_name() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden.txt");
    let present = present();
    if std::env::var_os("KITTIWAKE_WRITE_GOLDEN").is_some() {
        let text: String = present.iter().map(|it| format!("{it}\n")).collect();
        std::fs::write(&path, text).unwrap();
    }
    let golden: BTreeSet<String> = std::fs::read_to_string(&path).unwrap().lines().map(str::to_owned).collect();
    let gone: Vec<_> = golden.difference(&present).collect();
    assert!(
        gone.is_empty(),
        "other versions and old recordings still have these: give the new ones other numbers\n{gone:#?}"
    );
    let new: Vec<_> = present.difference(&golden).collect();
    assert!(new.is_empty(), "new: write them down with KITTIWAKE_WRITE_GOLDEN=1, and they stay as they are\n{new:#?}");
}

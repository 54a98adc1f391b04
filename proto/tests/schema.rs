//! Descriptions of messages for strangers.

use kittiwake_proto::schema::*;
use prost::Message as _;
use prost_reflect::DescriptorPool;
use prost_types::FileDescriptorSet;
use serde_json::{Value, json};

#[test]
fn a_descriptor_set_is_all_that_a_stranger_needs() {
    #[track_caller]
    fn check(name: &str, files: &[&str]) {
        let set = FileDescriptorSet::decode(file_descriptor_set(name).unwrap().as_slice()).unwrap();
        assert_eq!(set.file.iter().map(|it| it.name()).collect::<Vec<_>>(), files);
        let pool = DescriptorPool::from_file_descriptor_set(set).unwrap();
        assert!(pool.get_message_by_name(name).is_some());
    }
    let files = ["fmu", "skill", "planner", "mcm"].map(|it| format!("kittiwake/v1/{it}.proto"));
    check("kittiwake.v1.McmStatus", &files.each_ref().map(|it| it.as_str()));
    check("kittiwake.v1.Heartbeat", &["kittiwake/v1/health.proto"]);
    assert_eq!(file_descriptor_set("kittiwake.v1.Nothing"), None);
}

#[test]
fn every_reference_leads_somewhere() {
    let all = schemas(&[]);
    let text = Value::Object(all.clone()).to_string();
    let references = text.split("#/components/schemas/").skip(1).filter_map(|it| it.split('"').next());
    for name in references {
        assert!(all.contains_key(name), "{name}");
    }
    assert_eq!(all["kittiwake.v1.DecidePlan"]["properties"]["revision"]["format"], "uint64");
}

#[test]
fn a_request_may_leave_out_what_an_answer_always_has() {
    let all = schemas(&["kittiwake.v1.LandAt".to_owned()]);
    for sent in ["kittiwake.v1.LandAt", "kittiwake.v1.Ned"] {
        assert_eq!((all[sent].get("required"), &all[sent]["additionalProperties"]), (None, &json!(false)), "{sent}");
    }
    assert_eq!(all["kittiwake.v1.Vehicle.Flag"]["required"], json!(["name", "sinceS", "reason"]));
    assert_eq!(all["kittiwake.v1.CommandAuthority"]["required"], json!([]));
    assert_eq!(
        all["kittiwake.v1.Problem"]["properties"]["missing"]["additionalProperties"],
        json!({ "type": "array", "items": {} }),
        "without items a generated client drops the whole problem"
    );
}

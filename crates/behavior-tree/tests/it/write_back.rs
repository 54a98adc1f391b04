//! Writing tree files back, and what an editor needs to open them.

use behavior_tree::{Document, Element, Library, Port, Registry};

use crate::stories::reference;

#[test]
fn a_file_that_is_written_back_and_read_again_is_the_same() {
    let xml = r#"<root BTCPP_format="4" main_tree_to_execute="Main"><include path="other.xml"/>
        <BehaviorTree ID="Main"><Sequence name="a &lt; &quot;b&quot;"><Script code="x := 1 &amp;&amp; 2"/>
        <SubTree ID="Other" y="{x}" _autoremap="false"/></Sequence></BehaviorTree>
        <TreeNodesModel><SubTree ID="Other"><input_port name="y" default="2">why &amp; what</input_port></SubTree></TreeNodesModel>
        </root>"#;
    let other =
        r#"<root BTCPP_format="4"><BehaviorTree ID="Other"><AlwaysSuccess _skipIf="y > 1"/></BehaviorTree></root>"#;
    let registry = Registry::<()>::new();
    let load = |first: &str| {
        Library::load(&registry, [("main.xml", first), ("other.xml", other)])
            .unwrap_or_else(|errors| panic!("{errors}"))
    };
    let written = |library: &Library<()>| library.documents().next().map(|(_, it)| it.to_xml()).expect("a document");
    let once = written(&load(xml));
    let twice = written(&load(&once));
    assert_eq!(once, twice);
    assert!(once.contains(r#"<Script code="x := 1 &amp;&amp; 2"/>"#), "{once}");
    assert!(once.contains(r#"<input_port name="y" default="2">why &amp; what</input_port>"#), "{once}");
}

#[test]
fn the_models_of_registered_kinds_are_exported() {
    let mut registry = Registry::<()>::new();
    let ports = [
        Port::input::<f64>("min").default("20").describe("percent, at least"),
        Port::output::<bool>("low"),
        Port::inout::<i64>("count"),
    ];
    registry.condition("BatteryOk", ports, |_, _| Ok(true));
    registry.sync_action("Log", [Port::input::<behavior_tree::Value>("what")], |_, _| Ok(true));
    let xml = Document::new().models(registry.models()).to_xml();
    let expected = r#"<?xml version="1.0" encoding="UTF-8"?>
<root BTCPP_format="4">
  <TreeNodesModel>
    <Condition ID="BatteryOk">
      <input_port name="min" type="double" default="20">percent, at least</input_port>
      <output_port name="low" type="bool"/>
      <inout_port name="count" type="int"/>
    </Condition>
    <Action ID="Log">
      <input_port name="what"/>
    </Action>
  </TreeNodesModel>
</root>
"#;
    assert_eq!(xml, expected);
}

#[test]
fn a_tree_written_out_can_be_loaded_again() {
    let (tree, _) = reference::flying(true);
    let xml = tree.to_document().to_xml();
    let library = Library::load(&reference::registry(), [("written_out.xml", xml.as_str())]);
    let again = library.unwrap_or_else(|errors| panic!("{errors}")).instantiate("Mission", &[]).expect("no parameters");
    assert_eq!(again.len(), tree.len());
}

#[test]
fn a_tree_can_be_built_in_code() {
    let root = Element::new("Sequence").children((0..3).map(|_| Element::new("AlwaysSuccess")));
    let document = Document::new().main_tree("Made").tree("Made", root);
    let library = Library::load(&Registry::<()>::new(), [("made", document.to_xml())]);
    let library = library.unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(library.main_tree(), Some("Made"));
    assert_eq!(library.instantiate("Made", &[]).map(|tree| tree.len()), Ok(4));
}

#[test]
fn a_file_with_models_for_an_editor_loads_again() {
    let registry = reference::registry();
    let files = [("step.xml", reference::step_xml(true))];
    let library = Library::load(&registry, files).unwrap_or_else(|errors| panic!("{errors}"));
    let (name, document) = library.documents().next().expect("a document");
    let for_editor = document.clone().models(registry.models()).to_xml();
    assert!(
        for_editor.contains("<SubTree ID=\"Step\">") && for_editor.contains("<Action ID=\"Work\">"),
        "{for_editor}"
    );
    let again = Library::load(&registry, [(name, for_editor)]).unwrap_or_else(|errors| panic!("{errors}"));
    assert!(again.instantiate("Step", &[("goal", reference::goal())]).is_ok());
}

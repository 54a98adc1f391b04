//! Every mistake in a tree file is found at once, with its place and a hint.

use behavior_tree::{Element, Library, Port, Registry};

fn registry() -> Registry<()> {
    let mut registry = Registry::new();
    registry.condition("BatteryOk", [Port::input::<f64>("min")], |_, _| Ok(true));
    registry.sync_action("Measure", [Port::output::<f64>("level"), Port::inout::<i64>("count")], |_, _| Ok(true));
    registry
}

/// Loads one file and gives all errors as text.
fn errors(xml: &str) -> String {
    Library::load(&registry(), [("t.xml", xml)]).err().map_or_else(String::new, |errors| errors.to_string())
}

/// A tree with this root gives these errors; the line is that of the root.
#[track_caller]
fn check(root: &str, expected: &str) {
    let xml = format!("<root BTCPP_format=\"4\">\n<BehaviorTree ID=\"m\">\n{root}\n</BehaviorTree></root>");
    assert_eq!(errors(&xml), expected, "{root}");
}

#[test]
fn every_mistake_of_all_files_is_reported_at_once() {
    let first = r#"<root BTCPP_format="4" main_tree_to_execute="Mian">
  <include path="secnd.xml"/>
  <BehaviorTree ID="Main">
    <Sequnece name="a"/>
  </BehaviorTree>
</root>"#;
    let second = r#"<root BTCPP_format="4">
  <BehaviorTree ID="Other">
    <Sequence>
      <BateryOk min="2"/>
      <BatteryOk mni="2" name="a"/>
      <BatteryOk min="two" name="a"/>
      <BatteryOk min="{level}"/>
      <Inverter/>
      <SubTree ID="Mein"/>
      <AlwaysSuccess _skpIf="true" _skipIf="1 +"/>
    </Sequence>
  </BehaviorTree>
</root>"#;
    let found = Library::load(&registry(), [("first.xml", first), ("second.xml", second)]);
    let expected = "\
first.xml:1:24: there is no tree `Mian`; did you mean `Main`?
first.xml:2:12: include of `secnd.xml`, which is not among the files given; did you mean `second.xml`?
first.xml:4:5: unknown node `Sequnece`; did you mean `Sequence`?
second.xml:4:7: unknown node `BateryOk`; did you mean `BatteryOk`?
second.xml:5:7: `BatteryOk` needs its port `min`, an input of type double
second.xml:5:18: `BatteryOk` has no port `mni`; did you mean `min`?
second.xml:6:18: port `min`: \"two\" is no double
second.xml:6:28: two nodes are called `a` in tree `Other`
second.xml:7:18: nothing writes key `level`, which is read here
second.xml:8:7: `Inverter` has no child, it takes exactly 1 child
second.xml:9:7: there is no tree `Mein`; did you mean `Main`?
second.xml:10:22: unknown attribute `_skpIf`; did you mean `_skipIf`?
second.xml:10:36: an operand is missing at the end in the expression \"1 +\"";
    assert_eq!(found.err().expect("mistakes").to_string(), expected);
}

#[test]
fn a_file_that_is_no_tree_file_is_refused() {
    assert_eq!(errors("<root"), "t.xml:1:1: not well-formed XML: the document does not have a root node");
    let bare = "<root a=\"1 < 2\"/>";
    let hint = "inside an attribute `<` is written `&lt;` and `&` is written `&amp;`";
    assert_eq!(errors(bare), format!("t.xml:1:12: not well-formed XML: expected '\"' not '<'; {hint}"));
    assert_eq!(errors("<tree/>"), "t.xml:1:1: the first element is `tree`, not `root`");
    assert_eq!(errors("<root/>"), "t.xml:1:1: `root` must say BTCPP_format=\"4\"");
    let old = "<root BTCPP_format=\"3\"/>";
    assert_eq!(errors(old), "t.xml:1:1: `root` must say BTCPP_format=\"4\", not \"3\"");
    let stray = "<root BTCPP_format=\"4\"><Sequence/></root>";
    assert_eq!(errors(stray), "t.xml:1:24: `Sequence` does not belong directly below `root`");
}

#[test]
fn trees_are_named_once_and_not_like_nodes() {
    let tree = |id: &str| format!("<BehaviorTree{id}><AlwaysSuccess/></BehaviorTree>");
    let file = |trees: &[&str]| {
        let trees: String = trees.iter().map(|id| tree(id) + "\n").collect();
        format!("<root BTCPP_format=\"4\">\n{trees}</root>")
    };
    let twice = file(&[" ID=\"a\"", " ID=\"a\""]);
    assert_eq!(errors(&twice), "t.xml:3:15: there are two trees `a`");
    assert_eq!(errors(&file(&[""])), "t.xml:2:1: `BehaviorTree` needs the attribute `ID`");
    assert_eq!(errors(&file(&[" ID=\"Sequence\""])), "t.xml:2:15: tree `Sequence` has the name of a node");
}

#[test]
fn a_tree_that_contains_itself_is_refused() {
    let xml = r#"<root BTCPP_format="4">
<BehaviorTree ID="a"><SubTree ID="b"/></BehaviorTree>
<BehaviorTree ID="b"><SubTree ID="a"/></BehaviorTree></root>"#;
    let expected = "\
t.xml:2:22: tree `b` contains itself: b > a > b
t.xml:3:22: tree `a` contains itself: a > b > a";
    assert_eq!(errors(xml), expected);
}

#[test]
fn a_file_can_not_describe_trees_without_bound() {
    let mut xml = String::from("<root BTCPP_format=\"4\">");
    for level in 0..40 {
        let part = format!("<SubTree ID=\"t{}\"/>", level + 1);
        xml += &format!("<BehaviorTree ID=\"t{level}\"><Sequence>{part}{part}</Sequence></BehaviorTree>");
    }
    xml += "<BehaviorTree ID=\"t40\"><AlwaysSuccess/></BehaviorTree></root>";
    assert!(errors(&xml).contains("more than 65535 nodes"), "{}", errors(&xml));
}

#[test]
fn a_file_can_not_be_nested_without_bound() {
    let xml = |depth: usize| {
        let (open, close) = ("<Inverter>".repeat(depth), "</Inverter>".repeat(depth));
        format!("<root BTCPP_format=\"4\"><BehaviorTree ID=\"m\">{open}<AlwaysSuccess/>{close}</BehaviorTree></root>")
    };
    assert_eq!(errors(&xml(250)), "");
    assert!(errors(&xml(300)).contains("nested deeper than 256 levels"));
    assert!(errors(&xml(100_000)).contains("nested"));
}

#[test]
fn nodes_take_the_children_and_ports_they_declare() {
    check("<Sequence/>", "t.xml:3:1: `Sequence` has no child, it takes 1 or more");
    check("<AlwaysSuccess><AlwaysSuccess/></AlwaysSuccess>", "t.xml:3:1: `AlwaysSuccess` has 1 child, it takes none");
    let two = "<Inverter><AlwaysSuccess/><AlwaysSuccess/></Inverter>";
    check(two, "t.xml:3:1: `Inverter` has 2 children, it takes exactly 1 child");
    let one = "<IfThenElse><AlwaysSuccess/></IfThenElse>";
    check(one, "t.xml:3:1: `IfThenElse` has 1 child, it takes 2 or 3");
    check(
        "<Measure level=\"5\" count=\"{n}\"/>",
        "t.xml:3:10: port `level` is written by the node and needs a key in braces, not \"5\"",
    );
    check("<Measure/>", "t.xml:3:1: `Measure` needs its port `count`, an inout port of type int");
    check("<Measure count=\"{a b}\"/>", "t.xml:3:10: port `count`: \"{a b}\" is not a usable key");
    let limit = "<Timeout msec=\"-5\"><AlwaysSuccess/></Timeout>";
    check(limit, "t.xml:3:10: port `msec`: \"-5\" is no number of this range");
    let threshold = "<Parallel success_count=\"2\"><AlwaysSuccess/></Parallel>";
    check(threshold, "t.xml:3:11: 2 is more than the 1 children of this node");
}

#[test]
fn the_long_form_names_the_right_class() {
    check("<Control ID=\"Sequence\"><Condition ID=\"BatteryOk\" min=\"1\"/></Control>", "");
    check("<Action ID=\"Sequence\"><AlwaysSuccess/></Action>", "t.xml:3:1: `Sequence` is no Action");
    check("<Action/>", "t.xml:3:1: `Action` needs the attribute `ID`");
}

#[test]
fn a_key_has_one_type() {
    let root = "<Sequence><Measure level=\"{x}\" count=\"{n}\"/><Measure count=\"{x}\"/></Sequence>";
    check(root, "t.xml:3:54: key `x` is used as int here and as double at t.xml:3:20");
    let script = "<Sequence><Measure count=\"{n}\"/><Script code=\"n = 'one'\"/></Sequence>";
    let expected = "t.xml:3:41: std::string is assigned to `n`, which is int in the expression \"n = 'one'\"";
    check(script, expected);
    let condition = "<Sequence><Script code=\"t := 'a'\"/><AlwaysSuccess _skipIf=\"t\"/></Sequence>";
    check(condition, "t.xml:3:51: std::string is neither true nor false in the expression \"t\"");
    let literal = r#"<SubTree ID="s" min="low"/></BehaviorTree><BehaviorTree ID="s"><BatteryOk min="{min}"/>"#;
    check(literal, "t.xml:3:17: port `s::1/min`: \"low\" is no double");
}

#[test]
fn a_key_that_nothing_writes_is_a_mistake() {
    let misspelt = "<Sequence><Measure level=\"{level}\" count=\"{n}\"/><BatteryOk min=\"{levle}\"/></Sequence>";
    check(misspelt, "t.xml:3:60: nothing writes key `levle`, which is read here; did you mean `level`?");
    let assigned = "<Sequence><Script code=\"speed := 1\"/><Script code=\"sped = 2\"/></Sequence>";
    let expected =
        "t.xml:3:46: `sped` does not exist, `:=` would make it in the expression \"sped = 2\"; did you mean `speed`?";
    check(assigned, expected);
    let unused = r#"<SubTree ID="s" mni="3"/></BehaviorTree><BehaviorTree ID="s"><BatteryOk min="1"/>"#;
    check(unused, "t.xml:3:17: tree `s` has no key `mni` to be connected");
    let unused = r#"<SubTree ID="s" mni="{x}" min="3"/></BehaviorTree><BehaviorTree ID="s"><BatteryOk min="{min}"/>"#;
    check(unused, "t.xml:3:17: tree `s` has no key `mni` to be connected; did you mean `min`?");
}

#[test]
fn mistakes_in_the_registry_are_reported_too() {
    let mut registry = registry();
    registry.condition("Sequence", [], |_, _| Ok(true));
    registry.condition("BatteryOk", [], |_, _| Ok(true));
    registry.condition("Odd", ["a.b", "name", "_c", "d", "d"].map(Port::input::<i64>), |_, _| Ok(true));
    let errors = Library::load(&registry, [("t.xml", "<root BTCPP_format=\"4\"/>")]).err().expect("mistakes");
    let expected = "\
registry:1:1: `Sequence` is built in and cannot be registered again
registry:1:1: `BatteryOk` is registered twice
registry:1:1: `Odd` declares a port `a.b`, which is not a usable name
registry:1:1: `Odd` declares a port `name`, which is not a usable name
registry:1:1: `Odd` declares a port `_c`, which is not a usable name
registry:1:1: `Odd` declares the port `d` twice";
    assert_eq!(errors.to_string(), expected);
}

#[test]
fn only_the_first_hundred_mistakes_are_told() {
    let wrong: String = (0..150).map(|number| format!("<Wrong{number}/>")).collect();
    let xml =
        format!("<root BTCPP_format=\"4\"><BehaviorTree ID=\"m\"><Sequence>{wrong}</Sequence></BehaviorTree></root>");
    assert!(errors(&xml).ends_with("and 50 more"));
}

#[test]
fn attributes_of_editors_are_left_alone() {
    let root =
        Element::new("AlwaysSuccess").attribute("_uid", "1").attribute("_fullpath", "a").attribute("_color", "red");
    check(&root.to_xml(), "");
}

#[test]
fn a_file_full_of_mistakes_is_refused_quickly() {
    let wrong: String = (0..20_000).map(|number| format!("<BatteryOk min=\"{{key_{number}}}\" mni=\"\"/>")).collect();
    let right: String = (0..5_000).map(|number| format!("<Script code=\"kye_{number} := 1.5\"/>")).collect();
    let inside = format!("<Sequence>{right}{wrong}</Sequence>");
    let xml = format!("<root BTCPP_format=\"4\"><BehaviorTree ID=\"m\">{inside}</BehaviorTree></root>");
    assert!(errors(&xml).ends_with("and 39900 more"));
}

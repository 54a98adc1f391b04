//! All mistakes in tree files are found at once, with their places and hints.

use behavior_tree::{Element, Library, Port, Registry};

fn registry() -> Registry<()> {
    let mut registry = Registry::new();
    registry.condition("BatteryOk", [Port::input::<f64>("min")], |_, _| Ok(true));
    registry.sync_action("Measure", [Port::output::<f64>("level"), Port::inout::<i64>("count")], |_, _| Ok(true));
    registry
}

/// Loads one file. All errors as text.
fn errors(xml: &str) -> String {
    Library::load(&registry(), [("t.xml", xml)]).err().map_or_else(String::new, |errors| errors.to_string())
}

/// A tree with this root, which is in line 3, has these errors.
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
first.xml:2:12: the included file `secnd.xml` is not among the loaded files; did you mean `second.xml`?
first.xml:4:5: unknown node `Sequnece`; did you mean `Sequence`?
second.xml:4:7: unknown node `BateryOk`; did you mean `BatteryOk`?
second.xml:5:7: `BatteryOk` needs a value for its input port `min` of type double
second.xml:5:18: `BatteryOk` has no port `mni`; did you mean `min`?
second.xml:6:18: port `min`: expected double, found \"two\"
second.xml:6:28: two nodes are called `a` in tree `Other`
second.xml:7:18: nothing writes key `level`, which is read here
second.xml:8:7: `Inverter` takes exactly 1 child, found 0
second.xml:9:7: there is no tree `Mein`; did you mean `Main`?
second.xml:10:22: unknown attribute `_skpIf`; did you mean `_skipIf`?
second.xml:10:36: expression `1 +`: expected an operand, found the end";
    assert_eq!(found.err().expect("mistakes").to_string(), expected);
}

#[test]
fn a_file_without_trees_is_refused() {
    assert_eq!(errors("<root"), "t.xml:1:1: not well-formed XML: the document does not have a root node");
    let bare = "<root a=\"1 < 2\"/>";
    let hint = "inside an attribute, write `<` as `&lt;` and `&` as `&amp;`";
    assert_eq!(errors(bare), format!("t.xml:1:12: not well-formed XML: expected '\"' not '<'; {hint}"));
    assert_eq!(errors("<tree/>"), "t.xml:1:1: expected the element `root`, found `tree`");
    assert_eq!(errors("<root/>"), "t.xml:1:1: `root` needs BTCPP_format=\"4\"");
    let old = "<root BTCPP_format=\"3\"/>";
    assert_eq!(errors(old), "t.xml:1:1: `root` needs BTCPP_format=\"4\", found \"3\"");
    let stray = "<root BTCPP_format=\"4\"><Sequence/></root>";
    assert_eq!(errors(stray), "t.xml:1:24: `Sequence` is not allowed directly below `root`");
}

#[test]
fn trees_are_named_once_and_not_like_nodes() {
    let tree = |id: &str| format!("<BehaviorTree{id}><AlwaysSuccess/></BehaviorTree>");
    let file = |trees: &[&str]| {
        let trees: String = trees.iter().map(|id| tree(id) + "\n").collect();
        format!("<root BTCPP_format=\"4\">\n{trees}</root>")
    };
    let twice = file(&[" ID=\"a\"", " ID=\"a\""]);
    assert_eq!(errors(&twice), "t.xml:3:15: two trees have the ID `a`");
    assert_eq!(errors(&file(&[""])), "t.xml:2:1: `BehaviorTree` needs the attribute `ID`");
    assert_eq!(
        errors(&file(&[" ID=\"Sequence\""])),
        "t.xml:2:15: `Sequence` is a kind of node and cannot be the ID of a tree"
    );
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
fn the_number_of_nodes_is_limited() {
    let mut xml = String::from("<root BTCPP_format=\"4\">");
    for level in 0..40 {
        let part = format!("<SubTree ID=\"t{}\"/>", level + 1);
        xml += &format!("<BehaviorTree ID=\"t{level}\"><Sequence>{part}{part}</Sequence></BehaviorTree>");
    }
    xml += "<BehaviorTree ID=\"t40\"><AlwaysSuccess/></BehaviorTree></root>";
    assert!(errors(&xml).contains("more than 65535 nodes"), "{}", errors(&xml));
}

#[test]
fn the_depth_of_a_file_is_limited() {
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
    check("<Sequence/>", "t.xml:3:1: `Sequence` takes 1 or more children, found 0");
    check("<AlwaysSuccess><AlwaysSuccess/></AlwaysSuccess>", "t.xml:3:1: `AlwaysSuccess` takes no children, found 1");
    let two = "<Inverter><AlwaysSuccess/><AlwaysSuccess/></Inverter>";
    check(two, "t.xml:3:1: `Inverter` takes exactly 1 child, found 2");
    let one = "<IfThenElse><AlwaysSuccess/></IfThenElse>";
    check(one, "t.xml:3:1: `IfThenElse` takes 2 or 3 children, found 1");
    check(
        "<Measure level=\"5\" count=\"{n}\"/>",
        "t.xml:3:10: port `level`: expected a key in braces to write to, found \"5\"",
    );
    check("<Measure/>", "t.xml:3:1: `Measure` needs a value for its inout port `count` of type int");
    check("<Measure count=\"{a b}\"/>", "t.xml:3:10: port `count`: \"{a b}\" is not a valid key");
    let limit = "<Timeout msec=\"-5\"><AlwaysSuccess/></Timeout>";
    check(limit, "t.xml:3:10: port `msec`: expected an integer from 0 to 2147483647, found \"-5\"");
    let threshold = "<Parallel success_count=\"2\"><AlwaysSuccess/></Parallel>";
    check(threshold, "t.xml:3:11: `success_count` is 2, more than the node has children (1)");
}

#[test]
fn the_long_form_names_the_right_class() {
    check("<Control ID=\"Sequence\"><Condition ID=\"BatteryOk\" min=\"1\"/></Control>", "");
    check(
        "<Action ID=\"Sequence\"><AlwaysSuccess/></Action>",
        "t.xml:3:1: expected `Control ID=\"Sequence\"`, found `Action ID=\"Sequence\"`",
    );
    check("<Action/>", "t.xml:3:1: `Action` needs the attribute `ID`");
}

#[test]
fn a_key_has_one_type() {
    let root = "<Sequence><Measure level=\"{x}\" count=\"{n}\"/><Measure count=\"{x}\"/></Sequence>";
    check(root, "t.xml:3:54: key `x` is used as int here and as double at t.xml:3:20");
    let script = "<Sequence><Measure count=\"{n}\"/><Script code=\"n = 'one'\"/></Sequence>";
    let expected = "t.xml:3:41: expression `n = 'one'`: std::string cannot be assigned to key `n` of type int";
    check(script, expected);
    let condition = "<Sequence><Script code=\"t := 'a'\"/><AlwaysSuccess _skipIf=\"t\"/></Sequence>";
    check(condition, "t.xml:3:51: expression `t`: std::string is neither true nor false");
    let literal = r#"<SubTree ID="s" min="low"/></BehaviorTree><BehaviorTree ID="s"><BatteryOk min="{min}"/>"#;
    check(literal, "t.xml:3:17: port `s::1/min`: expected double, found \"low\"");
}

#[test]
fn a_key_that_nothing_writes_is_a_mistake() {
    let misspelt = "<Sequence><Measure level=\"{level}\" count=\"{n}\"/><BatteryOk min=\"{levle}\"/></Sequence>";
    check(misspelt, "t.xml:3:60: nothing writes key `levle`, which is read here; did you mean `level`?");
    let assigned = "<Sequence><Script code=\"speed := 1\"/><Script code=\"sped = 2\"/></Sequence>";
    let expected = "t.xml:3:46: expression `sped = 2`: key `sped` does not exist; `:=` makes it; did you mean `speed`?";
    check(assigned, expected);
    let unused = r#"<SubTree ID="s" mni="3"/></BehaviorTree><BehaviorTree ID="s"><BatteryOk min="1"/>"#;
    check(unused, "t.xml:3:17: nothing in tree `s` uses the key `mni`");
    let unused = r#"<SubTree ID="s" mni="{x}" min="3"/></BehaviorTree><BehaviorTree ID="s"><BatteryOk min="{min}"/>"#;
    check(unused, "t.xml:3:17: nothing in tree `s` uses the key `mni`; did you mean `min`?");
}

#[test]
fn mistakes_in_the_registry_are_reported_too() {
    let mut registry = registry();
    registry.condition("Sequence", [], |_, _| Ok(true));
    registry.condition("BatteryOk", [], |_, _| Ok(true));
    registry.condition("Odd", ["a.b", "name", "_c", "d", "d"].map(Port::input::<i64>), |_, _| Ok(true));
    let errors = Library::load(&registry, [("t.xml", "<root BTCPP_format=\"4\"/>")]).err().expect("mistakes");
    let expected = "\
registry:1:1: `Sequence` is a built-in node and cannot be registered
registry:1:1: `BatteryOk` is registered twice
registry:1:1: `Odd` declares a port `a.b`, which is not a valid name
registry:1:1: `Odd` declares a port `name`, which is not a valid name
registry:1:1: `Odd` declares a port `_c`, which is not a valid name
registry:1:1: `Odd` declares the port `d` twice";
    assert_eq!(errors.to_string(), expected);
}

#[test]
fn only_the_first_hundred_mistakes_are_listed() {
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

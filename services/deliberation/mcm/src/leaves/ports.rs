//! The types of the tree's ports.

use behavior_tree::Object;
use domain::plan::{AskAhead, PermissionNeed};

#[derive(Debug, Clone)]
pub(crate) struct Goal(pub(crate) domain::skill::Goal);

impl Object for Goal {
    const NAME: &'static str = "Goal";
}

#[derive(Debug, Clone)]
pub(crate) struct Condition(pub(crate) domain::plan::Condition);

impl Object for Condition {
    const NAME: &'static str = "Condition";
}

#[derive(Debug, Clone)]
pub(crate) struct Needs(pub(crate) Vec<PermissionNeed>);

impl Object for Needs {
    const NAME: &'static str = "Permissions";
}

/// Permissions to ask for because later steps need them, and when.
#[derive(Debug, Clone)]
pub(crate) struct Ahead(pub(crate) Vec<AskAhead>);

impl Object for Ahead {
    const NAME: &'static str = "PermissionsAhead";
}

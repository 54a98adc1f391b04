//! Values of types that the user of the engine defines.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

/// A type that the user of the engine defines and that ports can carry.
///
/// ```
/// #[derive(Clone, Debug)]
/// struct Waypoint { north: f64, east: f64 }
///
/// impl behavior_tree::Object for Waypoint {
///     const NAME: &'static str = "Waypoint";
///
///     /// `goal="12;4"` in a tree file.
///     fn parse(text: &str) -> Option<Self> {
///         let (north, east) = text.split_once(';')?;
///         Some(Waypoint { north: north.parse().ok()?, east: east.parse().ok()? })
///     }
/// }
/// ```
pub trait Object: Clone + fmt::Debug + Send + Sync + 'static {
    /// The name of the type in models, dumps and messages.
    const NAME: &'static str;

    /// Reads a constant from a tree file. `None` if `text` is not one.
    fn parse(_text: &str) -> Option<Self> {
        None
    }
}

/// A shared value of an [`Object`] type.
#[derive(Clone)]
pub struct ObjectValue(Arc<dyn AnyObject>);

impl ObjectValue {
    pub(crate) fn new<T: Object>(object: T) -> Self {
        ObjectValue(Arc::new(object))
    }

    pub(crate) fn as_any(&self) -> &dyn Any {
        self.0.as_any()
    }

    pub(crate) fn is_same(&self, other: &ObjectValue) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl fmt::Display for ObjectValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.debug(f)
    }
}

/// An [`Object`] whose type is known only at run time.
trait AnyObject: Any + Send + Sync {
    fn as_any(&self) -> &dyn Any;
    fn debug(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result;
}

impl<T: Object> AnyObject for T {
    fn as_any(&self) -> &dyn Any {
        self
    }

    fn debug(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

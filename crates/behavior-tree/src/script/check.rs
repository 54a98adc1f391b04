//! The types of expressions, inferred when a tree is loaded.

use super::expr::{Assignment, Binary, Expr, Unary};
use crate::values::types::Type;

/// What is wrong with an expression's types.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum TypeError {
    /// The operator cannot be applied to this type.
    Misfit(&'static str, Type),
    /// A value of this type is neither true nor false.
    NoCondition(Type),
    /// The operator cannot combine these types.
    Mixed(&'static str, Type, Type),
    /// A value of this type is assigned to a key of that type.
    Assigned(u32, Type, Type),
}

/// The type of an expression. `Any` if it is known only at run time. `key_type` has the types of the keys.
pub(crate) fn type_of(expr: &Expr, key_type: &dyn Fn(u32) -> Type) -> Result<Type, TypeError> {
    let type_of = |expr: &Expr| type_of(expr, key_type);
    match expr {
        Expr::Literal(value) => Ok(Type::of(value)),
        Expr::Key(key) => Ok(key_type(*key)),
        Expr::Unary(Unary::Not, operand) => condition(type_of(operand)?).map(|()| Type::Bool),
        Expr::Unary(Unary::Negate, operand) => match type_of(operand)? {
            Type::Bool => Ok(Type::Int),
            ty @ (Type::Any | Type::Int | Type::Float) => Ok(ty),
            ty => Err(TypeError::Misfit("-", ty)),
        },
        Expr::Unary(Unary::Complement, operand) => match type_of(operand)? {
            Type::Any | Type::Bool | Type::Int => Ok(Type::Int),
            ty => Err(TypeError::Misfit("~", ty)),
        },
        Expr::Binary(operator, left, right) => binary(*operator, type_of(left)?, type_of(right)?),
        Expr::Compare(first, rest) => {
            let mut left = type_of(first)?;
            for (operator, operand) in rest {
                let right = type_of(operand)?;
                let can_be_compared = match (left, right) {
                    (Type::Object(_), _) => return Err(TypeError::Misfit(operator.sign(), left)),
                    (_, Type::Object(_)) => return Err(TypeError::Misfit(operator.sign(), right)),
                    (Type::Any, _) | (_, Type::Any) => true,
                    (left, right) => (left == Type::Text) == (right == Type::Text),
                };
                if !can_be_compared {
                    return Err(TypeError::Mixed(operator.sign(), left, right));
                }
                left = right;
            }
            Ok(Type::Bool)
        }
        Expr::If(asked, then, otherwise) => {
            condition(type_of(asked)?)?;
            let (then, otherwise) = (type_of(then)?, type_of(otherwise)?);
            join(then, otherwise).ok_or(TypeError::Mixed("?:", then, otherwise))
        }
        Expr::Assign(key, how, value) => {
            let (declared, mut assigned) = (key_type(*key), type_of(value)?);
            if let Assignment::With(operator) = how {
                assigned = binary(*operator, declared, assigned)?;
            }
            if fits(declared, assigned) { Ok(declared) } else { Err(TypeError::Assigned(*key, assigned, declared)) }
        }
    }
}

/// Refuses types whose values are neither true nor false.
pub(crate) fn condition(ty: Type) -> Result<(), TypeError> {
    match ty {
        Type::Any | Type::Bool | Type::Int | Type::Float => Ok(()),
        Type::Text | Type::Object(_) => Err(TypeError::NoCondition(ty)),
    }
}

/// The narrowest type that holds values of both.
pub(crate) fn join(this: Type, that: Type) -> Option<Type> {
    match (this, that) {
        (Type::Any, _) | (_, Type::Any) => Some(Type::Any),
        (this, that) if this == that => Some(this),
        (Type::Bool, Type::Int) | (Type::Int, Type::Bool) => Some(Type::Int),
        (Type::Bool | Type::Int, Type::Float) | (Type::Float, Type::Bool | Type::Int) => Some(Type::Float),
        _ => None,
    }
}

fn fits(declared: Type, assigned: Type) -> bool {
    declared == Type::Any || assigned == Type::Any || join(declared, assigned) == Some(declared)
}

fn binary(operator: Binary, left: Type, right: Type) -> Result<Type, TypeError> {
    let sign = operator.sign();
    for ty in [left, right] {
        if let Type::Object(_) = ty {
            return Err(TypeError::Misfit(sign, ty));
        }
    }
    let is_text = left == Type::Text || right == Type::Text;
    let is_unknown = left == Type::Any || right == Type::Any;
    match operator {
        Binary::And | Binary::Or => {
            condition(left)?;
            condition(right)?;
            Ok(Type::Bool)
        }
        Binary::Concat if is_text || is_unknown => Ok(Type::Text),
        Binary::Concat => Err(TypeError::Misfit(sign, left)),
        Binary::Plus if left == Type::Text && right == Type::Text => Ok(Type::Text),
        _ if is_text && is_unknown && operator == Binary::Plus => Ok(Type::Text),
        _ if is_text => {
            Err(if left == right { TypeError::Misfit(sign, left) } else { TypeError::Mixed(sign, left, right) })
        }
        Binary::BitAnd | Binary::BitOr | Binary::BitXor => {
            match [left, right].into_iter().find(|ty| *ty == Type::Float) {
                Some(ty) => Err(TypeError::Misfit(sign, ty)),
                None => Ok(Type::Int),
            }
        }
        Binary::Divide => Ok(Type::Float),
        _ if is_unknown => Ok(Type::Any),
        _ if left == Type::Float || right == Type::Float => Ok(Type::Float),
        _ => Ok(Type::Int),
    }
}

impl TypeError {
    /// The error in words. `name` has the names of the keys.
    pub(crate) fn describe(&self, name: &dyn Fn(u32) -> String) -> String {
        match self {
            TypeError::Misfit(operator, ty) => format!("`{operator}` cannot be applied to {}", ty.name()),
            TypeError::NoCondition(ty) => format!("{} is neither true nor false", ty.name()),
            TypeError::Mixed(operator, left, right) => {
                format!("`{operator}` cannot combine {} and {}", left.name(), right.name())
            }
            TypeError::Assigned(key, assigned, declared) => {
                format!("{} cannot be assigned to key `{}` of type {}", assigned.name(), name(*key), declared.name())
            }
        }
    }
}

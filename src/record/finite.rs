//! Finds numbers that JSON cannot hold.
//!
//! A JSON writer turns NaN and infinity into `null` without a word. This serializer writes
//! nothing: it visits every number of a value and names the first one that is not finite.

use std::fmt::{self, Display};

use serde::{Serialize, ser};

/// Where a number is not finite, as a dotted path and the number itself.
#[derive(Debug)]
pub(super) struct NotFinite {
    path: Vec<&'static str>,
    what: String,
}

impl Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, key) in self.path.iter().rev().enumerate() {
            write!(f, "{}{key}", if i == 0 { "" } else { "." })?;
        }
        write!(f, "{}{}", if self.path.is_empty() { "" } else { ": " }, self.what)
    }
}

impl std::error::Error for NotFinite {}

impl ser::Error for NotFinite {
    fn custom<T: Display>(message: T) -> Self {
        Self { path: Vec::new(), what: message.to_string() }
    }
}

type Checked = Result<(), NotFinite>;

/// Demands that every number in `value` is finite.
pub(super) fn check<T: Serialize + ?Sized>(value: &T) -> Checked {
    value.serialize(Finite)
}

fn within<T: Serialize + ?Sized>(key: &'static str, value: &T) -> Checked {
    check(value).map_err(|mut fault| {
        fault.path.push(key);
        fault
    })
}

#[derive(Clone, Copy)]
struct Finite;

macro_rules! nothing_to_check {
    ($($name:ident($type:ty))*) => {
        $(fn $name(self, _value: $type) -> Checked { Ok(()) })*
    };
}

impl ser::Serializer for Finite {
    type Ok = ();
    type Error = NotFinite;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Self;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    nothing_to_check! {
        serialize_bool(bool) serialize_char(char) serialize_str(&str) serialize_bytes(&[u8])
        serialize_i8(i8) serialize_i16(i16) serialize_i32(i32) serialize_i64(i64)
        serialize_u8(u8) serialize_u16(u16) serialize_u32(u32) serialize_u64(u64)
        serialize_unit_struct(&'static str)
    }

    fn serialize_f32(self, value: f32) -> Checked {
        self.serialize_f64(f64::from(value))
    }

    fn serialize_f64(self, value: f64) -> Checked {
        if value.is_finite() {
            Ok(())
        } else {
            Err(ser::Error::custom(format_args!("the number is {value}, which is not finite")))
        }
    }

    fn serialize_none(self) -> Checked {
        Ok(())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Checked {
        check(value)
    }

    fn serialize_unit(self) -> Checked {
        Ok(())
    }

    fn serialize_unit_variant(self, _: &'static str, _: u32, _: &'static str) -> Checked {
        Ok(())
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, v: &T) -> Checked {
        check(v)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Checked {
        within(variant, value)
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_tuple(self, _: usize) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_map(self, _: Option<usize>) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, NotFinite> {
        Ok(self)
    }
}

macro_rules! check_elements {
    ($($trait:ident::$method:ident)*) => {
        $(impl ser::$trait for Finite {
            type Ok = ();
            type Error = NotFinite;
            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Checked { check(value) }
            fn end(self) -> Checked { Ok(()) }
        })*
    };
}

macro_rules! check_fields {
    ($($trait:ident)*) => {
        $(impl ser::$trait for Finite {
            type Ok = ();
            type Error = NotFinite;
            fn serialize_field<T: Serialize + ?Sized>(
                &mut self,
                key: &'static str,
                value: &T,
            ) -> Checked {
                within(key, value)
            }
            fn end(self) -> Checked { Ok(()) }
        })*
    };
}

check_elements! {
    SerializeSeq::serialize_element
    SerializeTuple::serialize_element
    SerializeTupleStruct::serialize_field
    SerializeTupleVariant::serialize_field
}
check_fields! { SerializeStruct SerializeStructVariant }

impl ser::SerializeMap for Finite {
    type Ok = ();
    type Error = NotFinite;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, _: &T) -> Checked {
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Checked {
        check(value)
    }

    fn end(self) -> Checked {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize)]
    #[serde(tag = "learner", rename_all = "snake_case")]
    enum Model {
        Rfwr { fields: Vec<Field> },
    }

    #[derive(Serialize)]
    struct Field {
        beta: [f64; 2],
        name: Option<f64>,
    }

    #[test]
    fn the_first_number_that_is_not_finite_is_named() {
        let model = |beta, name| Model::Rfwr { fields: vec![Field { beta, name }] };
        assert!(check(&model([f64::MAX, -0.0], None)).is_ok());
        let fault = check(&model([0.0, f64::NAN], None)).unwrap_err().to_string();
        assert_eq!(fault, "fields.beta: the number is NaN, which is not finite");
        let fault = check(&model([0.0; 2], Some(f64::NEG_INFINITY))).unwrap_err().to_string();
        assert_eq!(fault, "fields.name: the number is -inf, which is not finite");
    }
}

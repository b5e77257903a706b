//! Numpy arrays in and out. C-ordered arrays of f64 are read in place, all others are copied once.

use crate::error::{OrRaise, refuse};
use hwall::geometry::Pose;
use hwall::glam::{DMat4, DVec3};
use hwall::numeric::check::all_finite;
use numpy::{AllowTypeChange, Element, PyArray1, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods};
use numpy::{PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods, ndarray::IxDyn};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::borrow::Cow;
use std::ops::Deref;

/// Anything that numpy can convert to an array of f64 without a loss: no complex numbers, texts, times or masked values.
pub(crate) struct Floats<'py>(PyArrayLikeDyn<'py, f64, AllowTypeChange>);

impl<'py> Deref for Floats<'py> {
    type Target = PyReadonlyArrayDyn<'py, f64>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Floats<'py> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let plain = given.is_exact_instance_of::<PyUntypedArray>();
        if !(plain && given.cast::<PyArrayDyn<f64>>().is_ok()) {
            let numpy = given.py().import("numpy")?;
            // Of a list of arrays, too.
            let ma = numpy.getattr("ma")?;
            let array = ma.call_method1("asarray", (given,))?;
            if ma.call_method1("is_masked", (&array,))?.is_truthy()? {
                return refuse("an array with masked values: fill them or leave them out");
            }
            let dtype = array.getattr("dtype")?;
            let kind: char = dtype.getattr("kind")?.extract()?;
            if !"biufO".contains(kind) {
                let message = format!("values of type {dtype}, not real numbers");
                return Err(PyTypeError::new_err(message));
            }
        }
        Ok(Self(given.extract()?))
    }
}

/// A returned array.
pub(crate) type Array<'py, T = f64> = Bound<'py, PyArrayDyn<T>>;

/// One item or several, in C order.
pub(crate) struct Rows<'a> {
    values: Cow<'a, [f64]>,
    width: usize,
    /// Did the input have an axis for several items?
    pub(crate) many: bool,
    /// Their number; 1 for a single one.
    pub(crate) count: usize,
}

impl<'a> Rows<'a> {
    /// An array of the shape `item`, or `(n, *item)`.
    pub(crate) fn new(what: &str, array: &'a Floats<'_>, item: &[usize]) -> PyResult<Self> {
        let shape = array.shape();
        let many = shape.len() == item.len() + 1;
        if !(many && shape[1..] == *item || shape == item) {
            let many = [
                &["n".to_owned()],
                &*item.iter().map(ToString::to_string).collect::<Vec<_>>(),
            ]
            .concat();
            let (shape, item) = (tuple(shape), tuple(item));
            return refuse(format!(
                "{what} has the shape {shape}, it must be {item} or {}",
                tuple(&many)
            ));
        }
        let count = if many { shape[0] } else { 1 };
        Ok(Self {
            values: in_order(array),
            width: item.iter().product(),
            many,
            count,
        })
    }

    /// A single number.
    pub(crate) fn one(value: f64) -> Self {
        Self {
            values: Cow::Owned(vec![value]),
            width: 1,
            many: false,
            count: 1,
        }
    }

    /// The numbers of one item.
    pub(crate) fn row(&self, index: usize) -> &[f64] {
        &self.values[index * self.width..][..self.width]
    }

    /// All numbers.
    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }

    /// Points or vectors.
    pub(crate) fn vectors(&self) -> impl ExactSizeIterator<Item = DVec3> + '_ {
        self.values.chunks_exact(3).map(DVec3::from_slice)
    }
}

/// A shape in Python's notation.
pub(crate) fn tuple(sizes: &[impl ToString]) -> String {
    let sizes: Vec<String> = sizes.iter().map(ToString::to_string).collect();
    let comma = if sizes.len() == 1 { "," } else { "" };
    format!("({}{comma})", sizes.join(", "))
}

/// Numbers of an array in C order.
pub(crate) fn in_order<'a>(array: &'a Floats<'_>) -> Cow<'a, [f64]> {
    match array.as_slice() {
        Ok(values) if array.is_c_contiguous() => Cow::Borrowed(values),
        _ => Cow::Owned(array.as_array().iter().copied().collect()),
    }
}

/// Finite numbers of an array of one dimension; a single number counts as one.
pub(crate) fn list(what: &'static str, array: &Floats<'_>) -> PyResult<Vec<f64>> {
    if array.ndim() > 1 {
        return refuse(format!(
            "{what} has the shape {}, it must be (n,)",
            tuple(array.shape())
        ));
    }
    let values = in_order(array).into_owned();
    all_finite(what, &values).or_raise()?;
    Ok(values)
}

/// Exactly `N` finite numbers.
pub(crate) fn fixed<const N: usize>(what: &'static str, array: &Floats<'_>) -> PyResult<[f64; N]> {
    let values = in_order(array);
    match <[f64; N]>::try_from(&*values) {
        Ok(values) if array.ndim() == 1 => {
            all_finite(what, &values).or_raise()?;
            Ok(values)
        }
        _ => refuse(format!(
            "{what} has the shape {}, it must be ({N},)",
            tuple(array.shape())
        )),
    }
}

/// A point or a vector.
pub(crate) fn vector(what: &'static str, array: &Floats<'_>) -> PyResult<DVec3> {
    Ok(DVec3::from_array(fixed(what, array)?))
}

/// A homogeneous matrix, row by row, as a pose.
pub(crate) fn pose(row: &[f64]) -> Result<Pose, hwall::geometry::GeometryError> {
    let mut matrix = [0.0; 16];
    matrix.copy_from_slice(row);
    Pose::from_matrix(&DMat4::from_cols_array(&matrix).transpose())
}

/// One pose, `(4, 4)`.
pub(crate) fn one_pose(what: &str, array: &Floats<'_>) -> PyResult<Pose> {
    let rows = Rows::new(what, array, &[4, 4])?;
    if rows.many {
        return refuse(format!(
            "{what} has the shape {}, it must be (4, 4)",
            tuple(array.shape())
        ));
    }
    pose(rows.row(0)).or_raise()
}

/// The rows of a homogeneous matrix.
pub(crate) fn matrix(pose: &Pose) -> [f64; 16] {
    pose.to_matrix().transpose().to_cols_array()
}

/// An array of any shape.
pub(crate) fn array<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Array<'py, T>> {
    PyArray1::from_vec(py, values).reshape(IxDyn(shape))
}

/// The same, with an axis for several items if the input had one.
pub(crate) fn like<'py, T: Element>(
    py: Python<'py>,
    asked: &Rows<'_>,
    values: Vec<T>,
    item: &[usize],
) -> PyResult<Array<'py, T>> {
    match asked.many {
        true => array(py, values, &[&[asked.count], item].concat()),
        false => array(py, values, item),
    }
}

/// Points, `(n, 3)`.
pub(crate) fn points<'py>(
    py: Python<'py>,
    of: impl IntoIterator<Item = DVec3>,
) -> PyResult<Array<'py>> {
    let values: Vec<f64> = of.into_iter().flat_map(|p| p.to_array()).collect();
    let count = values.len() / 3;
    array(py, values, &[count, 3])
}

/// One point or vector, `(3,)`.
pub(crate) fn point<'py>(py: Python<'py>, p: DVec3) -> PyResult<Array<'py>> {
    array(py, p.to_array().to_vec(), &[3])
}

/// A symmetric matrix, (3, 3).
pub(crate) fn matrix3<'py>(py: Python<'py>, m: hwall::glam::DMat3) -> PyResult<Array<'py>> {
    array(py, m.to_cols_array().to_vec(), &[3, 3])
}

//! Files of learned models: versioned JSON that restores the model bit by bit, or an error that names the fault.

use super::input_file::FileInputs;
use super::length;
use super::tree_file::FileCorrection;
use crate::error::ContactError;
use crate::learned::blend::combination::Blend;
use crate::learned::blend::places::Places;
use crate::learned::config::{Combination, Frame};
use crate::learned::estimator::{Learnt, Origin};
use crate::learned::model::LearnedModel;
use crate::learned::primitive::hand_primitive::Primitive;
use crate::learned::regression::gates::Gates;
use crate::learned::regression::local_ridge::LocalRidge;
use crate::learned::regression::training::OUTPUTS;
use glam::DVec3;
use hwall_bip::model_file::{self, Digest, Format, ModelFileError};
use hwall_numeric::check::{non_negative, positive, that};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::io::{Read, Write};
use std::sync::Arc;

/// Format name and version written.
const FORMAT: Format = Format {
    name: "hwall-contact learned model",
    version: 9,
};

/// A whole file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u64,
    /// Digest of everything else, hexadecimal.
    digest: String,
    reaches: usize,
    people: usize,
    median_duration_s: f64,
    combination: Combination,
    frame: Frame,
    inputs: FileInputs,
    gates: Gates,
    /// With the place in the room, and without.
    ridges: [FileRidge; 2],
    time_from: usize,
    normal_from: usize,
    correction: FileCorrection,
    blend: Blend,
    places: Option<Places>,
    primitive: Option<FilePrimitive>,
    relied_on: Vec<bool>,
    /// The smaller model; its own digest is empty, as the digest of the file covers it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    alone: Option<Box<File>>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileRidge {
    centre: Vec<f64>,
    scale: Vec<f64>,
    outputs: usize,
    /// By region, feature (the constant last) and output.
    coefficients: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilePrimitive {
    label_offset_m: DVec3,
    /// A complete `hwall-bip` file with its own digest.
    model: Value,
}

impl LearnedModel {
    /// The model as JSON: a model read from it gives bit-identical estimates.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Strings and finite numbers only: nothing that could fail.
        let mut file = serde_json::to_value(File::of_model(self)).unwrap_or_default();
        file["digest"] = digest(&file).into();
        file.to_string()
    }

    /// Writes [`to_json`](Self::to_json).
    ///
    /// # Errors
    /// The writer fails.
    pub fn write_json(&self, writer: impl Write) -> Result<(), ContactError> {
        Ok(model_file::write(writer, &self.to_json())?)
    }

    /// Reads what [`to_json`](Self::to_json) wrote, on any machine. White space does not matter.
    ///
    /// # Errors
    /// The text is not JSON, has another format or a newer version, or was truncated or edited: lengths and ranges are checked one by one, and the
    /// whole against the digest.
    pub fn from_json(text: &str) -> Result<Self, ContactError> {
        let file: File = FORMAT.parse(text)?;
        let all = || std::iter::successors(Some(&file), |file| file.alone.as_deref());
        that(
            all().count() <= MOST_MODELS,
            "models",
            all().count() as f64,
            "at most 3",
        )?;
        all().try_for_each(File::validate)?;
        let value: Value = serde_json::from_str(text).map_err(ModelFileError::from)?;
        model_file::check_digest(&file.digest, digest(&value))?;
        file.into_model()
    }

    /// Reads a file to its end; see [`from_json`](Self::from_json).
    ///
    /// # Errors
    /// Errors of [`from_json`](Self::from_json); also if the reader fails or the text is not UTF-8.
    pub fn read_json(reader: impl Read) -> Result<Self, ContactError> {
        Self::from_json(&model_file::read(reader)?)
    }
}

/// Largest number of nested models in a file: with gaze, without gaze, and with the touching point alone.
const MOST_MODELS: usize = 3;

impl File {
    fn of_model(model: &LearnedModel) -> Self {
        let alone = model.alone.as_deref();
        Self {
            alone: alone.map(|alone| Box::new(Self::of_model(alone))),
            ..Self::of(&model.learnt)
        }
    }

    fn into_model(mut self) -> Result<LearnedModel, ContactError> {
        let alone = self.alone.take().map(|alone| alone.into_model());
        Ok(LearnedModel {
            alone: alone.transpose()?.map(Box::new),
            learnt: Arc::new(self.into_learnt()?),
        })
    }

    fn of(learnt: &Learnt) -> Self {
        let ridge = |ridge: &LocalRidge| FileRidge {
            centre: ridge.centre.clone(),
            scale: ridge.scale.clone(),
            outputs: ridge.outputs(),
            coefficients: ridge.coefficients().collect(),
        };
        Self {
            alone: None,
            format: FORMAT.name.to_owned(),
            version: FORMAT.version,
            digest: String::new(),
            reaches: learnt.origin.reaches,
            people: learnt.origin.people,
            median_duration_s: learnt.origin.median_duration_s,
            combination: learnt.combination,
            frame: learnt.frame,
            inputs: FileInputs::of(&learnt.inputs),
            gates: learnt.gates.clone(),
            ridges: learnt.ridges.each_ref().map(ridge),
            time_from: learnt.time_from,
            normal_from: learnt.normal_from,
            correction: FileCorrection::of(&learnt.correction),
            blend: learnt.blend.clone(),
            places: learnt.places.clone(),
            relied_on: learnt.relied_on.clone(),
            primitive: learnt.primitive.as_ref().map(|p| FilePrimitive {
                label_offset_m: p.label_offset_m,
                model: serde_json::from_str(&p.model.to_json()).unwrap_or_default(),
            }),
        }
    }

    /// Checks every assumption of the estimator. JSON cannot hold non-finite numbers.
    fn validate(&self) -> Result<(), ContactError> {
        let within = |what, value: usize, ok: bool, wanted| that(ok, what, value as f64, wanted);
        self.inputs.validate()?;
        let cues = self.inputs.to_inputs().cues().count();
        length("relied_on", cues, self.relied_on.len())?;
        let regions = self.gates.centres.len();
        within("gates", regions, regions > 0, "at least 1 region")?;
        positive("width of the gates", self.gates.width)?;
        positive("median_duration_s", self.median_duration_s)?;
        let scales = self.ridges.iter().flat_map(|ridge| &ridge.scale);
        for scale in scales.chain(&self.gates.scale) {
            non_negative("scale", *scale)?;
        }
        length("blend", regions, self.blend.regions.len())?;
        self.correction
            .validate(regions, self.inputs.to_inputs().width())?;
        self.blend.validate()?;
        if let Some(places) = &self.places {
            positive("scatter of places", places.scatter_m)?;
        }
        let width = self.inputs.to_inputs().width();
        for (ridge, other) in [(0, 1), (1, 0)].map(|(a, b)| (&self.ridges[a], &self.ridges[b])) {
            let outputs = ridge.outputs;
            let ok = outputs == OUTPUTS || outputs == OUTPUTS - 3;
            within("outputs", outputs, ok, "4, or 7 with normals")?;
            length("outputs", other.outputs, outputs)?;
            let known = ridge.centre.len();
            let ok = known == width;
            within("centre", known, ok, "as many as there are features")?;
            length("scale", width, ridge.scale.len())?;
            let entries = regions * (width + 1) * outputs;
            length("coefficients", entries, ridge.coefficients.len())?;
        }
        within("time_from", self.time_from, self.time_from < 2, "0 or 1")?;
        within(
            "normal_from",
            self.normal_from,
            self.normal_from < 2,
            "0 or 1",
        )?;
        let needed = usize::from(self.combination != Combination::Regression);
        length("primitive", needed, usize::from(self.primitive.is_some()))
    }

    /// From a valid file.
    fn into_learnt(self) -> Result<Learnt, ContactError> {
        let inputs = self.inputs.to_inputs();
        let primitive = match &self.primitive {
            None => None,
            Some(file) => {
                let model = hwall_bip::Model::from_json(&file.model.to_string())?;
                let dofs = model.dofs();
                if dofs != 3 && dofs != 3 * inputs.points() {
                    return Err(ContactError::FileLength {
                        what: "coordinates of the primitive",
                        expected: 3 * inputs.points(),
                        got: dofs,
                    });
                }
                Some(Primitive::new(model, file.label_offset_m)?)
            }
        };
        let ridges = self
            .ridges
            .map(|r| LocalRidge::from_parts(r.centre, r.scale, r.outputs, &r.coefficients));
        Ok(Learnt {
            origin: Origin {
                reaches: self.reaches,
                people: self.people,
                median_duration_s: self.median_duration_s,
            },
            gates: self.gates,
            ridges,
            time_from: self.time_from,
            normal_from: self.normal_from,
            correction: self.correction.into_correction(),
            places: self.places,
            blend: self.blend,
            relied_on: self.relied_on,
            combination: self.combination,
            frame: self.frame,
            inputs,
            primitive,
        })
    }
}

/// Digest of all fields but `digest`, in order of their names, so that white space and field order do not matter.
fn digest(file: &Value) -> String {
    let mut digest = Digest::new();
    if let Value::Object(fields) = file {
        let mut fields: Vec<_> = fields.iter().filter(|f| f.0 != "digest").collect();
        fields.sort_by_key(|f| f.0);
        for (name, value) in fields {
            absorb(&mut digest, name.as_bytes());
            absorb_value(&mut digest, value);
        }
    }
    digest.to_hex()
}

fn absorb(digest: &mut Digest, bytes: &[u8]) {
    digest.count(bytes.len()).bytes(bytes);
}

fn absorb_value(digest: &mut Digest, value: &Value) {
    match value {
        Value::Null => absorb(digest, b"null"),
        Value::Bool(b) => absorb(digest, &[u8::from(*b)]),
        Value::Number(n) => {
            let bits = n.as_f64().unwrap_or(f64::NAN).to_bits();
            absorb(digest, &bits.to_le_bytes());
        }
        Value::String(s) => absorb(digest, s.as_bytes()),
        Value::Array(values) => {
            absorb(digest, &(values.len() as u64).to_le_bytes());
            values.iter().for_each(|v| absorb_value(digest, v));
        }
        Value::Object(fields) => {
            let mut fields: Vec<_> = fields.iter().collect();
            fields.sort_by_key(|f| f.0);
            absorb(digest, &(fields.len() as u64).to_le_bytes());
            for (name, value) in fields {
                absorb(digest, name.as_bytes());
                absorb_value(digest, value);
            }
        }
    }
}

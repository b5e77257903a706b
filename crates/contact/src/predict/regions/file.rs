//! Files of region models: versioned JSON that restores the model bit by bit, or an error that names the fault.

use super::model::{KNOTS, RegionModel};
use super::sizes::REGION_SHARES;
use super::training::{LEAST_TOUCHES, MOST_LOGARITHM};
use crate::error::ContactError;
use hwall_bip::model_file::{self, Digest, Format};
use hwall_numeric::check::that;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};

/// Format name and version written.
const FORMAT: Format = Format {
    name: "hwall-contact regions",
    version: 1,
};

/// A whole file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u64,
    /// Digest of everything else, hexadecimal.
    digest: String,
    touches: usize,
    /// By remaining distance, for the regions in order of their shares.
    logarithms: [[f64; REGION_SHARES.len()]; KNOTS],
}

impl File {
    fn digest(&self) -> String {
        let mut digest = Digest::new();
        digest.bytes(self.format.as_bytes());
        digest.bytes(&self.version.to_le_bytes());
        digest.count(self.touches);
        for logarithms in &self.logarithms {
            digest.numbers(logarithms);
        }
        digest.to_hex()
    }

    /// A digest only protects against accidents, so check the numbers as well.
    fn validate(&self) -> Result<(), ContactError> {
        let enough = self.touches >= LEAST_TOUCHES;
        that(enough, "touches", self.touches as f64, "at least 4")?;
        for logarithm in self.logarithms.iter().flatten() {
            // NaN fails the comparison.
            let ok = logarithm.abs() <= MOST_LOGARITHM;
            that(ok, "logarithm of a size", *logarithm, "from -20 to 20")?;
        }
        Ok(())
    }
}

impl RegionModel {
    /// The model as JSON: a model read from it gives bit-identical regions.
    #[must_use]
    pub fn to_json(&self) -> String {
        let mut file = File {
            format: FORMAT.name.to_owned(),
            version: FORMAT.version,
            digest: String::new(),
            touches: self.touches,
            logarithms: self.logarithms,
        };
        file.digest = file.digest();
        // Strings and finite numbers only: nothing that could fail.
        serde_json::to_string(&file).unwrap_or_default()
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
    /// The text is not JSON, has another format or a newer version, fewer than 4 touches, sizes out of range, or was truncated or edited.
    pub fn from_json(text: &str) -> Result<Self, ContactError> {
        let file: File = FORMAT.parse(text)?;
        file.validate()?;
        model_file::check_digest(&file.digest, file.digest())?;
        Ok(Self {
            logarithms: file.logarithms,
            touches: file.touches,
        })
    }

    /// Reads a file to its end; see [`from_json`](Self::from_json).
    ///
    /// # Errors
    /// Errors of [`from_json`](Self::from_json); also if the reader fails or the text is not UTF-8.
    pub fn read_json(reader: impl Read) -> Result<Self, ContactError> {
        Self::from_json(&model_file::read(reader)?)
    }
}

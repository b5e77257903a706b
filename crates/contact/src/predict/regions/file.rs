//! Files of region models: versioned JSON that gives the model back bit by bit, or an error that says what is wrong.

use super::model::{KNOTS, RegionModel};
use super::sizes::REGION_SHARES;
use super::training::{LEAST_TOUCHES, MOST_LOGARITHM};
use crate::error::ContactError;
use hwall_bip::model_file::{self, Digest, Format};
use hwall_numeric::check::that;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};

/// What a file of this kind calls itself, and the version written.
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
    /// By the way left, for the regions in order of their shares.
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

    /// A digest is against accidents, so the numbers are looked at as well.
    fn validate(&self) -> Result<(), ContactError> {
        let enough = self.touches >= LEAST_TOUCHES;
        that(enough, "touches", self.touches as f64, "at least 4")?;
        for logarithm in self.logarithms.iter().flatten() {
            // NaN lies nowhere.
            let ok = logarithm.abs() <= MOST_LOGARITHM;
            that(ok, "logarithm of a size", *logarithm, "from -20 to 20")?;
        }
        Ok(())
    }
}

/// Writing and reading, with the feature `serde`.
impl RegionModel {
    /// The model as a file: regions of the model read are the same to the last bit.
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
    /// A writer that fails.
    pub fn write_json(&self, writer: impl Write) -> Result<(), ContactError> {
        Ok(model_file::write(writer, &self.to_json())?)
    }

    /// Reads what [`to_json`](Self::to_json) wrote, on any machine. White space does not matter.
    ///
    /// # Errors
    /// A text that is not JSON, another format, a newer version; fewer than 4 touches, sizes that nothing has; a file that was cut off or
    /// edited.
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
    /// As there; the reader fails, or what it holds is not UTF-8.
    pub fn read_json(reader: impl Read) -> Result<Self, ContactError> {
        Self::from_json(&model_file::read(reader)?)
    }
}

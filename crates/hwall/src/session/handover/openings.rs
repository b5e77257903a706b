//! Door openings, from the control loop to the tracker's side.

use super::sequence_lock::{Reader, Writer, sequence_lock};
use hwall_haptics::RenderedObject;
use hwall_scene::{Scene, SurfaceId};

/// Sends the positions of objects.
pub(in crate::session) struct OpeningSender {
    writer: Writer,
    told: Box<[f64]>,
}

/// Moves the surfaces of a scene as the objects moved.
pub(in crate::session) struct OpeningReceiver {
    reader: Reader,
    words: Box<[u64]>,
    surfaces: Box<[SurfaceId]>,
}

/// Both ends for the objects of these surfaces, in their order.
pub(in crate::session) fn openings(surfaces: &[SurfaceId]) -> (OpeningSender, OpeningReceiver) {
    let count = surfaces.len();
    let (writer, reader) = sequence_lock(count);
    let sender = OpeningSender {
        writer,
        told: vec![f64::NAN; count].into(),
    };
    let receiver = OpeningReceiver {
        reader,
        words: vec![0; count].into(),
        surfaces: surfaces.into(),
    };
    (sender, receiver)
}

impl OpeningSender {
    /// Sends the positions if one has changed.
    pub(in crate::session) fn tell(&mut self, objects: &[RenderedObject]) {
        let mut changed = false;
        for (told, rendered) in self.told.iter_mut().zip(objects) {
            let now = rendered.object.position();
            changed |= *told != now;
            *told = now;
        }
        if changed {
            self.writer.write(self.told.iter().map(|at| at.to_bits()));
        }
    }
}

impl OpeningReceiver {
    /// Applies the newest openings to the scene.
    pub(in crate::session) fn take(&mut self, scene: &mut Scene) {
        let count = self.words.len();
        if !self.reader.read(&mut self.words, |_| count) {
            return;
        }
        for (surface, word) in self.surfaces.iter().zip(&self.words) {
            let position = f64::from_bits(*word);
            if scene.opening(*surface) != Some(position) {
                // The object stays within the range of its surface.
                let _ = scene.set_opening(*surface, position);
            }
        }
    }
}

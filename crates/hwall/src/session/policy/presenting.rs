//! What the arm can do about a contact.

use hwall_contact::ContactPrediction;

/// What the arm can do about a contact, in the frame of the scene.
pub(in crate::session) trait Presenting {
    /// How soon the board is there from where the arm waits, s; infinite for a place that cannot be held, `None` where nobody knows.
    fn arrival_s(&self, contact: &ContactPrediction) -> Option<f64>;

    /// How far beside the place the middle of the board must stay, m: zero for a place that can be held, or where nobody knows, infinite
    /// where the board cannot be.
    fn beside_m(&self, contact: &ContactPrediction) -> f64;
}

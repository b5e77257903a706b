//! Where, when and which surface a tracked hand is about to touch: hand tracking filter, recordings, contact prediction.

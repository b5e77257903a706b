//! A stiff hand on an object: energy returned by the board, and decay of the oscillation.

use crate::leaning::{Path, Product};
use hwall_haptics::ObjectPortConfig;
use hwall_lab::feel::rig::{Rig, Way};
use hwall_lab::feel::stability::{Held, at_random, rendered};
use hwall_testkit::seeds;

/// Stiffer than any bare hand, N/m: some energy may be generated before an oscillation is felt.
const STIFF_N_PER_M: f64 = 3000.0;
/// Largest energy returned to any hand, J.
const MOST_J: f64 = 0.2;
/// The same to a bare hand without a link that misses answers, J.
const MOST_TO_BARE_J: f64 = 0.1;

/// The largest energy returned, J, and the number of hands: all, those under which the board swings on, those of them with a limit cycle.
#[derive(Default)]
struct Counted {
    most_j: f64,
    hands: [usize; 3],
}

impl Counted {
    fn add(&mut self, held: &Held) {
        self.most_j = self.most_j.max(held.generated_j);
        // A swing that shrinks by less than three tenths in a second is a limit cycle.
        let is_cycle = held.swings_on() && held.swing_m > 0.7 * held.before_m;
        let counts = [true, held.swings_on(), is_cycle];
        for (hands, counts) in self.hands.iter_mut().zip(counts) {
            *hands += usize::from(counts);
        }
    }
}

/// Bare hands, and stiffer ones.
#[derive(Default)]
struct Hands([Counted; 2]);

impl Hands {
    fn add(&mut self, held: &Held) {
        self.0[usize::from(held.stiffness_n_per_m > STIFF_N_PER_M)].add(held);
    }

    /// At most one bare hand in twenty may swing on; stiffer ones are counted.
    fn check(&self, of: &str) {
        let Self([bare, stiff]) = self;
        assert!(20 * bare.hands[1] <= bare.hands[0], "{of}: bare hands");
        for (kind, counted) in [("bare", bare), ("stiff", stiff)] {
            let [all, on, cycles] = counted.hands;
            println!("{of}, {kind} hands: {on} of {all} swing on, {cycles} in a limit cycle");
            assert!(counted.most_j <= MOST_J, "{of}: {} J", counted.most_j);
        }
    }
}

#[test]
fn no_rendering_gives_a_hand_more_than_the_reserve() {
    let rig = Rig::new().unwrap();
    let mut hands = Hands::default();
    for seed in seeds(1..2) {
        for lean in at_random(12, 1000 * seed) {
            for way in Way::ALL {
                hands.add(&rendered(&rig, way, &lean).unwrap());
            }
        }
    }
    hands.check("rendering");
    let reserve_j = ObjectPortConfig::default().reserve_j;
    assert!(hands.0[0].most_j <= reserve_j, "{}", hands.0[0].most_j);
}

#[test]
fn through_session_and_link_no_hand_gets_much_energy() {
    let product = Product::new().unwrap();
    for path in Path::ALL {
        let mut hands = Hands::default();
        for seed in seeds(1..2) {
            for lean in at_random(6, 1000 * seed) {
                hands.add(&product.lean(path, &lean).unwrap());
            }
        }
        let Hands([bare, stiff]) = &hands;
        println!(
            "goal: (f) energy that the board gives out beyond what a hand gave, and hands under which it swings by more than 2 mm after 3 s \
             (without shrinking to 70 % in a second; also hands that are stopped until the end), {path:?}, bare hands up to 3,000 N/m; stiffer ones | 0.1 J, 0 | \
             {:.3} J, {} ({}); {:.3} J, {} ({}) | {} hands; {}",
            bare.most_j,
            bare.hands[1],
            bare.hands[2],
            stiff.most_j,
            stiff.hands[1],
            stiff.hands[2],
            bare.hands[0],
            stiff.hands[0]
        );
        assert!(path == Path::Link || bare.most_j <= MOST_TO_BARE_J);
        hands.check(&format!("{path:?}"));
    }
}

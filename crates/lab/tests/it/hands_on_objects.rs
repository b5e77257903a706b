//! A stiff hand on a rendered object: energy returned by the board, and decay of the oscillation.

use hwall_haptics::ObjectPortConfig;
use hwall_lab::feel::rig::Rig;
use hwall_lab::feel::stability::{SWINGS_ON_M, at_random};
use hwall_testkit::seeds;

/// Stiffer than any bare hand, N/m: some energy may be generated before an oscillation is felt.
const STIFF_N_PER_M: f64 = 3000.0;
/// Largest energy returned to a stiff hand, J.
const OF_STIFF_J: f64 = 0.2;

#[test]
fn no_hand_gets_more_than_the_reserve() {
    let rig = Rig::new().unwrap();
    let reserve_j = ObjectPortConfig::default().reserve_j;
    let (mut bare, mut stiff, mut swing) = (0, 0, [0; 2]);
    let mut given_j = [0.0_f64; 2];
    for seed in seeds(1..2) {
        for held in at_random(&rig, 12, 1000 * seed).unwrap() {
            let is_stiff = held.stiffness_n_per_m > STIFF_N_PER_M;
            let most_j = if is_stiff { OF_STIFF_J } else { reserve_j };
            let given_j = &mut given_j[usize::from(is_stiff)];
            *given_j = given_j.max(held.generated_j);
            assert!(held.generated_j <= most_j, "{seed}: {held:?}");
            bare += usize::from(!is_stiff);
            stiff += usize::from(is_stiff);
            swing[usize::from(is_stiff)] += usize::from(held.swing_m > SWINGS_ON_M);
        }
    }
    println!(
        "goal: (f) energy that the board gives out beyond what a hand gave, bare hands up to 3,000 N/m (stiffer ones in brackets) \
         | {reserve_j} J ({OF_STIFF_J} J) | {:.3} J ({:.3} J) | {bare} hands ({stiff})",
        given_j[0], given_j[1]
    );
    println!(
        "swing on: {} of {bare} bare hands, {} of {stiff} stiff ones",
        swing[0], swing[1]
    );
    assert!(20 * swing[0] <= bare, "{} of {bare}", swing[0]);
}

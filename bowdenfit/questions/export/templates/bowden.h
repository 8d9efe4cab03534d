/*
$about
 *
 * Forces are in newtons. Link with the mathematics library (-lm). No function allocates memory, aborts or keeps a state.
 *
 * Arguments of every function:
 *   level   amount of friction: BOWDEN_Q50 for the median, BOWDEN_Q05 and BOWDEN_Q95 for low and high friction,
 *           BOWDEN_MOUNTING_Q05 and BOWDEN_MOUNTING_Q95 for any one mounting of the cable, BOWDEN_DRAW + i for draw i
 *   place   $place_words
 *   speed   $speed_words
 *   flags   warnings are set in it, one bit each (enum bowden_flag); may be a null pointer (0)
 */
#ifndef BOWDEN_H
#define BOWDEN_H

#include <math.h>

#define BOWDEN_VERSION "$version"
#define BOWDEN_SEED "$seed"
#define BOWDEN_PLACES $n_places
#define BOWDEN_LEVELS $n_levels
#define BOWDEN_DRAWS (BOWDEN_LEVELS - BOWDEN_DRAW)
#define BOWDEN_ANYWHERE $anywhere /* 1: friction is the same everywhere */
#define BOWDEN_LOOP $is_loop /* 1: a pull-pull loop; 0: a single rope */
#define BOWDEN_LOAD_DEPENDENT $of_load
#define BOWDEN_RATE_DEPENDENT $of_rate
#define BOWDEN_PRESLIDING $of_turns /* 1: bowden_move has friction build up after a turn; 0: bowden_step */
#define BOWDEN_REFERENCE_SPEED $reference_speed

enum bowden_level { BOWDEN_Q05, BOWDEN_Q50, BOWDEN_Q95, BOWDEN_MOUNTING_Q05, BOWDEN_MOUNTING_Q95, BOWDEN_DRAW };

enum bowden_flag {
    BOWDEN_CLAMPED = 1, /* the place is outside the range; the nearest end was used */
    BOWDEN_SLACK = 2,   /* no force remains: a rope pulls or is slack, but never pushes */
    BOWDEN_INVALID = 4  /* the level does not exist, or an input is NAN: the result is NAN */
};

static const double bowden_place[BOWDEN_PLACES] = {
$place
};

/* Friction exponent while pulling and while returning, by level and place. */
static const double bowden_exponent[BOWDEN_LEVELS][2][BOWDEN_PLACES] = {
$exponent
};
$more_tables
static inline void bowden_raise(int *flags, int flag)
{
    if (flags) {
        *flags |= flag;
    }
}

/* Value of a table at a place: linear interpolation, and the value at the nearest end outside the range. */
static inline double bowden_at(const double *table, double place, int *flags)
{
    int low = 0, high = BOWDEN_PLACES - 1;

    if (BOWDEN_ANYWHERE) {
        return table[0];
    }
    if (isnan(place)) {
        bowden_raise(flags, BOWDEN_INVALID);
        return NAN;
    }
    if (place <= bowden_place[0]) {
        if (place < bowden_place[0]) {
            bowden_raise(flags, BOWDEN_CLAMPED);
        }
        return table[0];
    }
    if (place >= bowden_place[BOWDEN_PLACES - 1]) {
        if (place > bowden_place[BOWDEN_PLACES - 1]) {
            bowden_raise(flags, BOWDEN_CLAMPED);
        }
        return table[BOWDEN_PLACES - 1];
    }
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (bowden_place[middle] <= place) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return table[low] + (table[high] - table[low]) * ((place - bowden_place[low]) / (bowden_place[high] - bowden_place[low]));
}

/* Whether the arguments are valid; sets BOWDEN_INVALID in the flags if they are not. */
static inline int bowden_valid(int level, double speed, double force, int *flags)
{
    if (level < 0 || level >= BOWDEN_LEVELS || isnan(force) || (BOWDEN_RATE_DEPENDENT && isnan(speed))) {
        bowden_raise(flags, BOWDEN_INVALID);
        return 0;
    }
    return 1;
}

/* Factor by which speed changes friction: 1 at the reference speed. */
static inline double bowden_rate(int level, double speed)
{
#if BOWDEN_RATE_DEPENDENT
    const double *c = bowden_rate_coefficients[level];
    const double v = fabs(speed), u = v / c[1], r = BOWDEN_REFERENCE_SPEED / c[1];
    return (1.0 + c[0] * exp(-u * u) + c[2] * v) / (1.0 + c[0] * exp(-r * r) + c[2] * BOWDEN_REFERENCE_SPEED);
#else
    (void)level;
    (void)speed;
    return 1.0;
#endif
}

/* Friction exponent at a place and a speed; stroke: +1 pulling, -1 returning. */
static inline double bowden_lambda(int level, double place, double speed, int stroke, int *flags)
{
    return bowden_rate(level, speed) * bowden_at(bowden_exponent[level][stroke < 0], place, flags);
}

$law
/*
 * Force at the load side while the cable slides, computed from the force at the motor side.
 * stroke: +1 pulling (a loop: moving forward), -1 returning (back).
 */
static inline double bowden_output(int level, double place, double speed, double input_force, int stroke, int *flags)
{
    if (!bowden_valid(level, speed, input_force, flags)) {
        return NAN;
    }
    return bowden_slid(level, place, speed, input_force, stroke, 1.0, flags);
}

/* Force at the motor side that gives output_force at the load side while the cable slides: the inverse of bowden_output. */
static inline double bowden_input(int level, double place, double speed, double output_force, int stroke, int *flags)
{
    if (!bowden_valid(level, speed, output_force, flags)) {
        return NAN;
    }
    return bowden_slid(level, place, speed, output_force, stroke, -1.0, flags);
}

$motion/*
 * Force to add at the motor so that output_force arrives at the load, for the friction that any one mounting of the cable
 * exceeds with a probability of 95 %: the most that can be compensated without overcompensation, considering one place and
 * one mounting. With the unknown inertia, dead zone and damping of a device, less is safe: see bowdenfit compensate.
 */
static inline double bowden_compensation(double place, double speed, double output_force, int stroke, int *flags)
{
    return bowden_input(BOWDEN_MOUNTING_Q05, place, speed, output_force, stroke, flags) - output_force;
}

$track#endif

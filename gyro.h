/*
 * A Takagi-Sugeno-Kang fuzzy model written by skanfis; generated, not to be edited.
 *
 * 36 rules, order 1; C99, double.
 * Per evaluation, whatever the row, at most: 42 exponentials, 0 logarithms, 29 square roots, 791
 * multiply-adds, 4 divisions.
 * Memory: 3260 bytes of tables, 816 of arrays on the stack.
 *
 * Inputs x, and their range in the training data:
 *   [0] x0: -11.2299 to 64.4321
 *   [1] x1: -97.219 to 96.311
 * Outputs y, and what they are held within:
 *   [0] y: -6.6022 to 6.5935
 *
 * Outside this range the model goes on along its tangent, for each input up to 0.5 of its
 * standard deviations, and holds the value reached there.
 * A row that is not finite gets no output either way.
 * A row is uncovered where its coverage is below 0.1.
 *
 * Constant tables, no heap, no state: safe to call from several threads and from interrupts.
 * Compile without -ffast-math, which takes away the check of the inputs.
 *
 * MISRA C:2012, by cppcheck: required rules are kept, but not 10.1: the status is an int, and bits
 * of it are set. Of the advisory ones Dir 4.6 and 4.9 (plain types, macros like functions), 2.5,
 * 8.7, 8.9, 12.1, 12.3, 15.5 and 18.4 are not kept. No one has certified it.
 */
#ifndef GYRO_H
#define GYRO_H

#ifdef __cplusplus
extern "C" {
#endif

#define GYRO_N_INPUTS 2
#define GYRO_N_OUTPUTS 1

/* The status is the sum of these. */
#define GYRO_IN_RANGE 0
#define GYRO_OUT_OF_RANGE 1 /* an input lies outside the range of the training data */
#define GYRO_NOT_FINITE 2 /* an input is infinite or not a number */
#define GYRO_UNCOVERED 4 /* hardly any training data lie near the inputs */
#define GYRO_NO_OUTPUT 8 /* y holds no answer */

/* Evaluates the model at x, writes y, returns the status. */
int gyro_predict(const double x[GYRO_N_INPUTS], double y[GYRO_N_OUTPUTS]);

#ifdef GYRO_SELF_TEST
/* Returns 0, or else the number of the first test row that fails, counted from 1. */
int gyro_self_test(void);
#endif

#ifdef __cplusplus
}
#endif

#endif /* GYRO_H */

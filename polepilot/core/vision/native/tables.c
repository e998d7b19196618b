/* Functions as tables: the normal distribution, and grey levels as light. */
#include "internal.h"

#include <math.h>

float eye_cumulative_table[EYE_STEPS + 2], eye_bell_table[EYE_STEPS + 2];
float eye_linear_table[256], eye_fine_table[4096];

static double srgb(double grey)
{
    return grey <= 0.04045 ? grey / 12.92 : pow((grey + 0.055) / 1.055, 2.4);
}

/* Before anything else runs, so that all threads find the tables full. */
__attribute__((constructor)) static void fill_tables(void)
{
    for (int i = 0; i < EYE_STEPS + 2; i++) {
        double z = 2 * EYE_REACH * i / EYE_STEPS - EYE_REACH;
        eye_cumulative_table[i] = (float)(0.5 * erfc(-z / sqrt(2.0)));
        eye_bell_table[i] = (float)(exp(-0.5 * z * z) / sqrt(2.0 * 3.14159265358979323846));
    }
    for (int i = 0; i < 256; i++)
        eye_linear_table[i] = (float)srgb(i / 255.0);
    for (int i = 0; i < 4096; i++)
        eye_fine_table[i] = (float)srgb(i / 4080.0);
}

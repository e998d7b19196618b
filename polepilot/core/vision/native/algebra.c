/* Small numbers: the normal distribution, linear equations, grey levels as light, codes. */
#include "eye.h"

#include <math.h>
#include <string.h>

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

/* Solves matrix x = right in place by Cholesky; ``matrix`` (n x n, symmetric, row by row) is
 * overwritten, ``right`` holds ``rights`` columns side by side. 0 where it is not positive. */
int eye_solve(double *matrix, double *right, int n, int rights)
{
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = matrix[i * n + j];
            for (int k = 0; k < j; k++)
                sum -= matrix[i * n + k] * matrix[j * n + k];
            if (i == j) {
                if (!(sum > 0.0))
                    return 0;
                matrix[i * n + i] = sqrt(sum);
            } else {
                matrix[i * n + j] = sum / matrix[j * n + j];
            }
        }
    }
    for (int c = 0; c < rights; c++) {
        for (int i = 0; i < n; i++) {
            double sum = right[i * rights + c];
            for (int k = 0; k < i; k++)
                sum -= matrix[i * n + k] * right[k * rights + c];
            right[i * rights + c] = sum / matrix[i * n + i];
        }
        for (int i = n - 1; i >= 0; i--) {
            double sum = right[i * rights + c];
            for (int k = i + 1; k < n; k++)
                sum -= matrix[k * n + i] * right[k * rights + c];
            right[i * rights + c] = sum / matrix[i * n + i];
        }
    }
    return 1;
}

/* The id of a code (top first, '1' = bright), or 0 where it is no legal code. */
int eye_decode(const char *code, int segments)
{
    int id = 0;
    if (code[0] != '1' || code[1] != '1' || code[segments - 1] != '1' || code[segments - 2] != '1')
        return 0;
    for (int i = 2; i < segments - 2; i++) {
        if (code[i] != '1')
            continue;
        if (i % 2 == 0)
            return 0;
        id |= 1 << (i - 3) / 2;
    }
    return id;
}

void eye_encode(int id, int bits, char *code)
{
    int segments = 2 * bits + 5;
    memset(code, '0', (size_t)segments);
    code[0] = code[1] = code[segments - 1] = code[segments - 2] = '1';
    for (int bit = 0; bit < bits; bit++)
        if (id >> bit & 1)
            code[3 + 2 * bit] = '1';
    code[segments] = '\0';
}

// Compares $header with undertow's own simulation: cc -std=c99 -Wall $test -lm && ./a.out
// Add -D${upper}_FLOAT for single precision.
#include "$header"
#include <stdio.h>

$arrays

static double worst = 0.0;

static void compare(${prefix}real found, double expected, double size)
{
    const double error = fabs((double)found - expected) / size;
    if (!(error <= worst)) worst = error;
}

static void copy(${prefix}real *into, const double *from, int count)
{
    int k;
    for (k = 0; k < count; k++) into[k] = (${prefix}real)from[k];
}

int main(void)
{
    int k, j;
    for (k = 0; k < $rows; k++) {
$derivatives
        for (j = 0; j < $rates; j++) compare(rate[j], drawn_expected[k][j], drawn_sizes[j]);
    }
    {
        ${prefix}real state[$states];
        {
$start
        }
        for (k = 0; k < $steps; k++) {
$step
            for (j = 0; j < $states; j++) state[j] = after[j];
            for (j = 0; j < 6; j++) compare(state[j], driven_expected[k][j], driven_sizes[j]);
        }
    }
    printf("largest error: %.3g\n", worst);
    return worst <= (sizeof(${prefix}real) == sizeof(float) ? 1e-4 : 1e-9) ? 0 : 1;
}

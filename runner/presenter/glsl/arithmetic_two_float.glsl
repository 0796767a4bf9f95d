// The numbers that colours are computed in, each as the sum of two floats, `high` and `low`, with 48 bits: where the
// driver has no 64-bit floats, or has slow ones. How to use them is written in arithmetic_double.glsl. Of a matrix there
// are three floats, so that what remains of a saturated colour's dark channel is as exact as in 64 bits.
//
// The sum of two floats and what it was rounded by, from six sums: [Knuth1998]; a product, from halves of 12 bits:
// [Dekker1971]. Halves are made by masking, which cannot overflow. That needs sums computed as they are written.
// GLSL 4.00 says so by `precise`; without it KEPT hides from the compiler that a number is what it is, by a uniform
// that is 0. runner.presenter.arithmetic tests at the start what each driver makes of it.

#define TWO_FLOATS

#ifdef GUARDED
#define EXACT
uniform uint unchanged_bits;      // 0
float KEPT(float x) { return uintBitsToFloat(floatBitsToUint(x) ^ unchanged_bits); }
vec3 KEPT(vec3 x) { return uintBitsToFloat(floatBitsToUint(x) ^ uvec3(unchanged_bits)); }
#else
#define EXACT precise
#define KEPT(x) (x)
#endif

struct Real { float high; float low; };
struct Real3 { vec3 high; vec3 low; };
struct Real3x3 { mat3 high; mat3 middle; mat3 low; };

// a + b; |a| >= |b| or a = 0.
Real ordered_sum(float a, float b) {
    EXACT float sum = KEPT(a + b);
    EXACT float rest = b - KEPT(sum - a);
    return Real(sum, rest);
}

Real3 ordered_sum(vec3 a, vec3 b) {
    EXACT vec3 sum = KEPT(a + b);
    EXACT vec3 rest = b - KEPT(sum - a);
    return Real3(sum, rest);
}

Real exact_sum(float a, float b) {
    EXACT float sum = KEPT(a + b);
    EXACT float of_b = KEPT(sum - a);
    EXACT float of_a = KEPT(sum - of_b);
    EXACT float rest = KEPT(a - of_a) + KEPT(b - of_b);
    return Real(sum, rest);
}

Real3 exact_sum(vec3 a, vec3 b) {
    EXACT vec3 sum = KEPT(a + b);
    EXACT vec3 of_b = KEPT(sum - a);
    EXACT vec3 of_a = KEPT(sum - of_b);
    EXACT vec3 rest = KEPT(a - of_a) + KEPT(b - of_b);
    return Real3(sum, rest);
}

const uint UPPER_HALF = 0xFFFFF000u;

Real exact_product(float a, float b) {
    EXACT float product = KEPT(a * b);
    float a_high = uintBitsToFloat(floatBitsToUint(a) & UPPER_HALF);
    float b_high = uintBitsToFloat(floatBitsToUint(b) & UPPER_HALF);
    EXACT float a_low = KEPT(a - a_high);
    EXACT float b_low = KEPT(b - b_high);
    EXACT float rest = KEPT(KEPT(KEPT(a_high * b_high - product) + a_high * b_low) + a_low * b_high) + a_low * b_low;
    return Real(product, rest);
}

Real3 exact_product(vec3 a, vec3 b) {
    EXACT vec3 product = KEPT(a * b);
    vec3 a_high = uintBitsToFloat(floatBitsToUint(a) & uvec3(UPPER_HALF));
    vec3 b_high = uintBitsToFloat(floatBitsToUint(b) & uvec3(UPPER_HALF));
    EXACT vec3 a_low = KEPT(a - a_high);
    EXACT vec3 b_low = KEPT(b - b_high);
    EXACT vec3 rest = KEPT(KEPT(KEPT(a_high * b_high - product) + a_high * b_low) + a_low * b_high) + a_low * b_low;
    return Real3(product, rest);
}

// A float that is beyond all light, or no number, must not become a difference of infinities.
const float MOST = 1e30;

Real real(float x) { return Real(clamp(x, -MOST, MOST), 0.0); }
Real real(float high, float low) { return exact_sum(high, low); }
Real3 real3(vec3 v) { return Real3(clamp(v, vec3(-MOST), vec3(MOST)), vec3(0.0)); }
Real3 real3(vec3 high, vec3 low) { return exact_sum(high, low); }
Real3 real3(Real r, Real g, Real b) { return Real3(vec3(r.high, g.high, b.high), vec3(r.low, g.low, b.low)); }
float float_of(Real a) { return a.high; }
vec3 floats_of(Real3 a) { return a.high; }
Real channel_of(Real3 a, int channel) { return Real(a.high[channel], a.low[channel]); }

Real add(Real a, float b) {
    Real sum = exact_sum(a.high, b);
    return ordered_sum(sum.high, sum.low + a.low);
}

Real add(Real a, Real b) {
    Real sum = exact_sum(a.high, b.high);
    Real rest = exact_sum(a.low, b.low);
    sum = ordered_sum(sum.high, sum.low + rest.high);
    return ordered_sum(sum.high, sum.low + rest.low);
}

Real3 add(Real3 a, vec3 b) {
    Real3 sum = exact_sum(a.high, b);
    return ordered_sum(sum.high, sum.low + a.low);
}

Real3 add(Real3 a, Real3 b) {
    Real3 sum = exact_sum(a.high, b.high);
    Real3 rest = exact_sum(a.low, b.low);
    sum = ordered_sum(sum.high, sum.low + rest.high);
    return ordered_sum(sum.high, sum.low + rest.low);
}

Real sub(Real a, float b) { return add(a, -b); }
Real sub(Real a, Real b) { return add(a, Real(-b.high, -b.low)); }
Real3 sub(Real3 a, vec3 b) { return add(a, -b); }
Real3 sub(Real3 a, Real3 b) { return add(a, Real3(-b.high, -b.low)); }

Real mul(Real a, float b) {
    Real product = exact_product(a.high, b);
    return ordered_sum(product.high, product.low + a.low * b);
}

Real mul(Real a, Real b) {
    Real product = exact_product(a.high, b.high);
    return ordered_sum(product.high, product.low + (a.high * b.low + a.low * b.high));
}

Real3 mul(Real3 a, vec3 b) {
    Real3 product = exact_product(a.high, b);
    return ordered_sum(product.high, product.low + a.low * b);
}

Real3 mul(Real3 a, Real3 b) {
    Real3 product = exact_product(a.high, b.high);
    return ordered_sum(product.high, product.low + (a.high * b.low + a.low * b.high));
}

Real3 mul(Real3 a, float b) { return mul(a, vec3(b)); }
Real3 mul(Real3 a, Real b) { return mul(a, Real3(vec3(b.high), vec3(b.low))); }

Real3 mul(Real3x3 matrix, Real3 a) {
    // Terms of the first order, of the second, 2^-24 of them, and of the third, of which no remainders are needed.
    vec3 first = vec3(0.0);
    vec3 second = vec3(0.0);
    vec3 third = vec3(0.0);
    for (int column = 0; column < 3; column++) {
        vec3 high = vec3(a.high[column]);
        vec3 low = vec3(a.low[column]);
        Real3 product = exact_product(matrix.high[column], high);
        Real3 sum = exact_sum(first, product.high);
        first = sum.high;
        Real3 rest = exact_sum(product.low, sum.low);
        third += rest.low;
        product = exact_product(matrix.middle[column], high);
        third += product.low;
        sum = exact_sum(rest.high, product.high);
        third += sum.low;
        product = exact_product(matrix.high[column], low);
        third += product.low + matrix.middle[column] * low + matrix.low[column] * high;
        rest = exact_sum(sum.high, product.high);
        third += rest.low;
        sum = exact_sum(second, rest.high);
        second = sum.high;
        third += sum.low;
    }
    Real3 sum = exact_sum(first, second);
    return exact_sum(sum.high, sum.low + third);
}

Real div(Real a, float b) {
    float first = a.high / b;
    Real rest = sub(a, exact_product(first, b));
    float second = rest.high / b;
    rest = sub(rest, exact_product(second, b));
    Real sum = ordered_sum(first, second);
    return add(sum, rest.high / b);
}

Real div(Real a, Real b) {
    float first = a.high / b.high;
    Real rest = sub(a, mul(b, first));
    float second = rest.high / b.high;
    rest = sub(rest, mul(b, second));
    Real sum = ordered_sum(first, second);
    return add(sum, rest.high / b.high);
}

Real3 div(Real3 a, Real b) {
    return real3(div(channel_of(a, 0), b), div(channel_of(a, 1), b), div(channel_of(a, 2), b));
}

Real3 div(Real3 a, float b) {
    return real3(div(channel_of(a, 0), b), div(channel_of(a, 1), b), div(channel_of(a, 2), b));
}

// One of Newton's steps from the float's root. Drivers' own may be off by a few units in the last place.
Real root(Real a) {
    float guess = sqrt(max(a.high, 0.0));
    Real rest = sub(a, exact_product(guess, guess));
    return ordered_sum(guess, guess > 0.0 ? 0.5 * rest.high / guess : 0.0);
}

Real3 root(Real3 a) {
    vec3 guess = sqrt(max(a.high, vec3(0.0)));
    Real3 rest = sub(a, exact_product(guess, guess));
    bvec3 none = lessThanEqual(guess, vec3(0.0));
    return ordered_sum(guess, mix(0.5 * rest.high / mix(guess, vec3(1.0), none), vec3(0.0), none));
}

bool at_most(Real a, Real b) { return a.high < b.high || (a.high == b.high && a.low <= b.low); }

Real lesser(Real a, Real b) { return at_most(a, b) ? a : b; }
Real greater(Real a, Real b) { return at_most(a, b) ? b : a; }

Real limit(Real a, float low, float high) { return lesser(greater(a, Real(low, 0.0)), Real(high, 0.0)); }

Real3 limit(Real3 a, Real3 low, Real3 high) {
    for (int channel = 0; channel < 3; channel++) {
        Real limited = lesser(greater(channel_of(a, channel), channel_of(low, channel)), channel_of(high, channel));
        a.high[channel] = limited.high;
        a.low[channel] = limited.low;
    }
    return a;
}

Real3 limit(Real3 a, float low, float high) {
    return limit(a, Real3(vec3(low), vec3(0.0)), Real3(vec3(high), vec3(0.0)));
}

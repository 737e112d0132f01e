// What the kernels share whose workgroup owns a tile eight words wide and eight rows high, an invocation a word: around it they read a
// word at either side and two rows above and below. Included after WIDE (16-bit pixels) is defined or not.
const int kRows = 8, kWords = 8;
const int kWordsRead = kWords + 2, kRowsRead = kRows + 4;

// A word's even and odd pixels lie in two lanes of 16 bits each, 16-bit pixels alone.
#ifdef WIDE
uint from_left(uint w, uint left) { return left; }
uint from_right(uint w, uint right) { return right; }
#else
uint from_left(uint w, uint left) { return (w << 16) | (left >> 16); }
uint from_right(uint w, uint right) { return (w >> 16) | (right << 16); }
#endif

// The even and odd pixels of a word with those one and two beside them.
struct Along {
  uint even, odd, even_2l, even_2r, odd_1l, odd_2r;
};
Along along(uint even, uint odd, uint even_left, uint even_right, uint odd_left, uint odd_right) {
  return Along(even, odd, from_left(even, even_left), from_right(even, even_right), from_left(odd, odd_left),
               from_right(odd, odd_right));
}
// Binomial 1 4 6 4 1 along the row, even pixels in x.
uvec2 binomial(Along a) {
  return uvec2(a.even_2l + a.even_2r + ((a.odd_1l + a.even + a.odd) << 2) + (a.even << 1),
               a.odd_1l + a.odd_2r + ((a.even + a.odd + a.even_2r) << 2) + (a.odd << 1));
}

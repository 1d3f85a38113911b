/* Edit distance with transposed neighbours counted once (optimal string alignment), case ignored. A name that
 * begins with the word is as good as one typing mistake, so that "--check" finds "--checkpoint-every". */
#include "nearest.h"

#include <ctype.h>
#include <stdint.h>
#include <string.h>

static int same(char a, char b) {
    return tolower((unsigned char)a) == tolower((unsigned char)b);
}

static size_t smaller(size_t a, size_t b) {
    return a < b ? a : b;
}

static size_t edit_distance(const char *a, size_t a_count, const char *b, size_t b_count) {
    size_t rows[3][NEAREST_NAME_SIZE];
    size_t *before = rows[0], *last = rows[1], *now = rows[2];
    for (size_t j = 0; j <= b_count; j++)
        last[j] = before[j] = j;
    for (size_t i = 1; i <= a_count; i++) {
        now[0] = i;
        for (size_t j = 1; j <= b_count; j++) {
            size_t cost = same(a[i - 1], b[j - 1]) ? 0 : 1;
            now[j] = smaller(smaller(last[j], now[j - 1]) + 1, last[j - 1] + cost);
            if (i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]))
                now[j] = smaller(now[j], before[j - 2] + 1);
        }
        size_t *spare = before;
        before = last;
        last = now;
        now = spare;
    }
    return last[b_count];
}

static void offer(Nearest *nearest, const char *name, size_t count) {
    size_t word_count = strlen(nearest->word);
    if (word_count >= NEAREST_NAME_SIZE || count >= NEAREST_NAME_SIZE)
        return;
    size_t distance = edit_distance(nearest->word, word_count, name, count);
    size_t common = 0;
    while (common < word_count && common < count && same(nearest->word[common], name[common]))
        common++;
    if (common == word_count && word_count >= 3 && distance > 1)
        distance = 1;
    if (distance < nearest->distance) {
        nearest->distance = distance;
        memcpy(nearest->best, name, count);
        nearest->best[count] = '\0';
    }
}

Nearest nearest_begin(const char *word) {
    return (Nearest){.word = word, .distance = SIZE_MAX};
}

void nearest_offer(Nearest *nearest, const char *name) {
    offer(nearest, name, strlen(name));
}

void nearest_offer_list(Nearest *nearest, const char *names) {
    while (*names) {
        size_t count = strcspn(names, "|");
        offer(nearest, names, count);
        names += count + (names[count] == '|');
    }
}

const char *nearest_result(const Nearest *nearest) {
    size_t tolerated = (strlen(nearest->word) + 1) / 3;
    return nearest->distance <= tolerated ? nearest->best : NULL;
}

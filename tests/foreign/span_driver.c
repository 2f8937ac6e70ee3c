/* Runs one native span in a process of another platform.

   driver LIBRARY CASE RESULT

   CASE is what `spans.py` wrote: blobs of memory, where in them the addresses of other blobs and of functions belong,
   and the entry to call. RESULT is the entry's status and all blobs afterwards. Any C compiler, any platform. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#ifdef _WIN32
#include <windows.h>
static void *open_library(const char *path) { return (void *)LoadLibraryA(path); }
static void *find(void *library, const char *name) { return (void *)GetProcAddress((HMODULE)library, name); }
#else
#include <dlfcn.h>
static void *open_library(const char *path) { return dlopen(path, RTLD_NOW); }
static void *find(void *library, const char *name) { return dlsym(library, name); }
#endif

typedef int64_t (*Entry)(double, double *, int64_t *);

static int64_t next(FILE *file) {
  int64_t value;
  if (fread(&value, 8, 1, file) != 1) exit(3);
  return value;
}

static void *function(void *library, FILE *file) {
  char name[128];
  if (fread(name, sizeof name, 1, file) != 1) exit(3);
  void *found = find(library, name);
  if (!found) { fprintf(stderr, "no %s\n", name); exit(4); }
  return found;
}

int main(int argc, char **argv) {
  void *library = argc == 4 ? open_library(argv[1]) : NULL;
  FILE *file = argc == 4 ? fopen(argv[2], "rb") : NULL;
  if (!library || !file) { fprintf(stderr, "cannot open the library or the case\n"); return 2; }
  int64_t count = next(file);
  int64_t **blobs = calloc(count, sizeof *blobs), *sizes = calloc(count, sizeof *sizes);
  for (int64_t i = 0; i < count; i++) {
    sizes[i] = next(file);
    blobs[i] = malloc(8 * sizes[i] + 8);
    if (fread(blobs[i], 8, sizes[i], file) != (size_t)sizes[i]) return 3;
  }
  for (int64_t left = next(file); left > 0; left--) { /* blob, word, blob it points to, right shift of the address */
    int64_t *blob = blobs[next(file)];
    int64_t *word = blob + next(file);
    int64_t address = (int64_t)(intptr_t)blobs[next(file)];
    *word = address >> next(file);
  }
  for (int64_t left = next(file); left > 0; left--) { /* blob, word, function it points to */
    int64_t *blob = blobs[next(file)];
    int64_t *word = blob + next(file);
    *word = (int64_t)(intptr_t)function(library, file);
  }
  Entry entry = (Entry)function(library, file);
  int64_t status = entry(0.0, NULL, blobs[next(file)]);
  fclose(file);
  file = fopen(argv[3], "wb");
  fwrite(&status, 8, 1, file);
  for (int64_t i = 0; i < count; i++) fwrite(blobs[i], 8, sizes[i], file);
  return fclose(file);
}

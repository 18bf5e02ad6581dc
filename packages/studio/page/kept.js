// What outlasts a reload: files and texts, in the database of this page.
const [NAME, STORE] = ['shsa-studio', 'work'];

function opened() {
  return new Promise((resolve, reject) => {
    const request = indexedDB.open(NAME, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(STORE);
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

async function within(mode, act) {
  const database = await opened();
  try {
    return await new Promise((resolve, reject) => {
      const transaction = database.transaction(STORE, mode);
      const request = act(transaction.objectStore(STORE));
      transaction.oncomplete = () => resolve(request.result);
      transaction.onabort = () => reject(transaction.error);
    });
  } finally {
    database.close();
  }
}

// A browser that keeps nothing, as in private windows, is no reason to stop.
const tolerant = (promise) => promise.catch(() => undefined);

export const put = (key, value) => tolerant(within('readwrite', (store) => store.put(value, key)));
export const take = (key) => tolerant(within('readonly', (store) => store.get(key)));
export const clear = () => tolerant(within('readwrite', (store) => store.clear()));
